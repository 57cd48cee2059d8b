"""Every pair, looked at one by one.

The oracle for faster searches, and all that is needed when no distance is too far.
"""

import numpy as np

from scene_graph_ros.geometry.broadphase.pair_tests import (
    box_reaches_half_space,
    boxes_are_near,
    is_pair_wanted,
)
from scene_graph_ros.geometry.compiled.kernel import kernel

__all__ = ["all_candidate_pairs"]


@kernel
def all_candidate_pairs(lower, upper, is_half_space, X_WG, frame, filter_bits, margin):
    """Return the candidates of ``candidate_pairs`` by looking at all n (n - 1) / 2 pairs."""
    n = len(lower)
    pairs = np.empty((max(n * (n - 1) // 2, 1), 2), np.int64)
    count = 0
    for i in range(n):
        for j in range(i + 1, n):
            if not is_pair_wanted(frame, filter_bits, i, j):
                continue
            if is_half_space[i] and is_half_space[j]:
                near = True
            elif is_half_space[i]:
                near = box_reaches_half_space(lower, upper, j, X_WG, i, margin)
            elif is_half_space[j]:
                near = box_reaches_half_space(lower, upper, i, X_WG, j, margin)
            else:
                near = boxes_are_near(lower, upper, i, j, margin)
            if near:
                pairs[count, 0] = i
                pairs[count, 1] = j
                count += 1
    return pairs[:count]
