"""Signed distances of a list of pairs: the loop around ``distance_pair``.

Penetration, signed distance and the test for any collision share this one loop, so that they
cannot disagree.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.accuracy import Accuracy
from scene_graph_ros.geometry.compiled.kernel import lean_kernel
from scene_graph_ros.geometry.narrowphase.convex_distance import new_workspace
from scene_graph_ros.geometry.query.distance.certificate import certify_pairs
from scene_graph_ros.geometry.query.distance.dispatch import distance_pair
from scene_graph_ros.geometry.spatial.vectors import (
    add,
    load_rotation,
    load_translation,
    relative_pose,
    rotate,
    rotate_inverse,
    store_vector,
    subtract,
)
from scene_graph_ros.geometry.tables.held_table import borrowed_table, HeldTable
from scene_graph_ros.geometry.tolerances import OSCULATION

__all__ = ["EXACT", "FIRST_PENETRATION", "NO_FAILURE", "PENETRATIONS", "WITHIN", "solve_pairs"]

WITHIN = 0
"""Keep pairs whose signed distance is at most ``max_distance``."""
PENETRATIONS = 1
"""Keep pairs deeper than OSCULATION times the larger of the two sizes."""
FIRST_PENETRATION = 2
"""As PENETRATIONS, and stop at the first."""

NO_FAILURE = -1

EXACT = Accuracy.EXACT.bound
"""Relative to the larger size: up to this accuracy, answers are polished to rounding."""


@lean_kernel
def _solve(places, X_WG, pairs, max_distance, keep, accuracy, columns, work):
    """Write the kept pairs into ``columns``; return how many, and the pair without an answer."""
    table = borrowed_table(places)
    rows, phis, p_ACas, p_BCbs, p_WCas, p_WCbs, nhats, uniques, gaps, deciders = columns
    is_asked = deciders.shape[0] > 0
    count = 0
    for k in range(pairs.shape[0]):
        i, j = pairs[k, 0], pairs[k, 1]
        R_WA, p_WA = load_rotation(X_WG, i), load_translation(X_WG, i)
        R_WB, p_WB = load_rotation(X_WG, j), load_translation(X_WG, j)
        R_AB, p_AB = relative_pose(R_WA, p_WA, R_WB, p_WB)
        size = max(table.scale[i], table.scale[j])
        phi, p_ACa, p_ACb, nhat_BA_A, unique, gap, decided_by = distance_pair(
            table, i, j, R_AB, p_AB, max_distance, accuracy * size, work
        )
        if math.isnan(phi):
            return count, k
        if keep == WITHIN:
            if phi > max_distance:
                continue
        elif phi >= -OSCULATION * size:
            continue
        rows[count, 0], rows[count, 1] = i, j
        phis[count], uniques[count], gaps[count] = phi, unique, gap
        if is_asked:
            deciders[count] = decided_by
        store_vector(p_ACas, count, p_ACa)
        store_vector(p_BCbs, count, rotate_inverse(R_AB, subtract(p_ACb, p_AB)))
        store_vector(p_WCas, count, add(p_WA, rotate(R_WA, p_ACa)))
        store_vector(p_WCbs, count, add(p_WA, rotate(R_WA, p_ACb)))
        store_vector(nhats, count, rotate(R_WA, nhat_BA_A))
        count += 1
        if keep == FIRST_PENETRATION:
            return count, NO_FAILURE
    return count, NO_FAILURE


def solve_pairs(
    held: HeldTable,
    X_WG: NDArray[np.float64],
    pairs: NDArray[np.int64],
    max_distance: float,
    keep: int,
    accuracy: float = EXACT,
    certify: bool = False,
) -> tuple[Any, ...]:
    """Compute the signed distance of pairs of rows and keep those asked for.

    Args:
        held: a ShapeTable of n rows.
        X_WG: (n, 4, 4).
        pairs: (m, 2) rows (A, B).
        max_distance: in metres; 0 for penetrations.
        keep: WITHIN, PENETRATIONS or FIRST_PENETRATION.
        accuracy: the largest error of the distance, relative to the larger of both sizes, its
            sign being certain; up to EXACT, all is polished to rounding. A looser one saves time
            where the distance is found by iteration. Then the distance is too large at most (a
            depth: too large), the witnesses keep ``p_WCa - p_WCb = distance * nhat_BA_W`` and
            stay in their shapes, and the normal is good to about its square root.
        certify: fill ``gap`` for every pair, see ``certify_pairs``; otherwise it is what the
            iterations know, 0 where there are none. Fill ``decided_by``, too.

    Returns:
        The columns of k kept pairs, in the order given: rows (k, 2), distance (k,), p_ACa,
        p_BCb, p_WCa, p_WCb, nhat_BA_W (k, 3), unique (k,), gap (k,), decided_by (k,), integers of
        ``Mechanism``, or (0,) unless ``certify``; and the index of the first pair that has no
        answer, or NO_FAILURE.

    """
    m = len(pairs)
    columns = (
        np.empty((m, 2), np.int64),
        np.empty(m),
        *(np.empty((m, 3)) for _ in range(5)),
        np.empty(m, np.bool_),
        np.empty(m),
        np.empty(m if certify else 0, np.uint8),
    )
    loose = accuracy if accuracy > EXACT else 0.0
    count, failed = _solve(
        held.places, X_WG, pairs, float(max_distance), keep, loose, columns, new_workspace()
    )
    kept = tuple(column[:count] for column in columns)
    if certify:
        rows, phi, p_ACa, p_BCb, _, _, nhat_BA_W, _, gap, _ = kept
        certify_pairs(held.table, X_WG, rows, phi, p_ACa, p_BCb, nhat_BA_W, gap)
    return (*kept, failed)
