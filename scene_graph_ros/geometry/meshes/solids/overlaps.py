"""Which boxes overlap: in pairs, and directly or by way of others."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.kernel import kernel, lean_kernel
from scene_graph_ros.geometry.meshes.bvh import traversal_stack

__all__ = ["boxes_meet", "groups_of_boxes", "meeting_boxes", "next_leaf"]


@lean_kernel
def boxes_meet(i, j, lower, upper):
    """Return whether two boxes meet."""
    for axis in range(3):
        if lower[i, axis] > upper[j, axis] or upper[i, axis] < lower[j, axis]:
            return False
    return True


@lean_kernel
def next_leaf(stack, depth, lower, upper, i, tree):
    """Return (slot, end, depth) of the next leaf of a tree that box i of (n, 3) boxes meets.

    Its boxes are ``order[slot:end]``; there is none where both are equal. Begin with depth 1 and
    0 at the bottom of the stack, and go on with the depth that is returned.
    """
    node_lower, node_upper, left, right, _ = tree
    while depth > 0:
        depth -= 1
        node = stack[depth]
        meets = True
        for axis in range(3):
            meets = meets and lower[i, axis] <= node_upper[node, axis]
            meets = meets and upper[i, axis] >= node_lower[node, axis]
        if not meets:
            continue
        if left[node] < 0:
            first = -1 - left[node]
            return first, first + right[node], depth
        stack[depth], stack[depth + 1] = right[node], left[node]
        depth += 2
    return 0, 0, 0


@kernel
def meeting_boxes(lower, upper, tree):
    """Return (k, 2) rows: which of n boxes meet which of a tree's; twice the work, no guess."""
    order = tree[4]
    stack = traversal_stack()
    count = 0
    pairs = np.empty((0, 2), np.int64)
    for fill in range(2):
        if fill == 1:
            pairs = np.empty((count, 2), np.int64)
        count = 0
        for i in range(len(lower)):
            stack[0] = 0
            slot, end, depth = next_leaf(stack, 1, lower, upper, i, tree)
            while slot < end:
                for k in range(slot, end):
                    if fill == 1:
                        pairs[count, 0], pairs[count, 1] = i, order[k]
                    count += 1
                slot, end, depth = next_leaf(stack, depth, lower, upper, i, tree)
    return pairs


def groups_of_boxes(
    lower: NDArray[np.float64], upper: NDArray[np.float64]
) -> list[NDArray[np.int64]]:
    """Return the rows of (n, 3) boxes in groups: those that touch are in one, and so on."""
    n = len(lower)
    group = np.arange(n)

    def root(i: int) -> int:
        while group[i] != i:
            group[i] = group[group[i]]
            i = int(group[i])
        return i

    order = np.argsort(lower[:, 0], kind="stable")
    low, high = lower[order], upper[order]
    ends = np.searchsorted(low[:, 0], high[:, 0], side="right")
    for i in range(n):
        others = slice(i + 1, ends[i])
        meets = (low[others, 1:] <= high[i, 1:]).all(axis=1)
        meets &= (high[others, 1:] >= low[i, 1:]).all(axis=1)
        for j in np.flatnonzero(meets) + i + 1:
            a, b = root(int(order[i])), root(int(order[j]))
            group[max(a, b)] = min(a, b)
    roots = np.array([root(i) for i in range(n)], dtype=np.int64)
    in_order = np.argsort(roots, kind="stable")
    starts = np.flatnonzero(np.diff(roots[in_order], prepend=-1))
    return np.split(in_order, starts[1:]) if n else []
