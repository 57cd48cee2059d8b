"""Signed distances of a list of pairs: the loop around ``distance_pair``.

Penetration, signed distance and the test for any collision share this one loop, so that they
cannot disagree.
"""

import math

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.accuracy import Accuracy
from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.query.distance.certificate import certify_pairs
from scene_graph_ros.geometry.query.distance.dispatch import are_turned, distance_pair
from scene_graph_ros.geometry.query.distance.solved_pairs import (
    BOTH,
    DECIDED_BY,
    GAP,
    LOCAL_AT,
    NHAT_BA_W,
    NO_FAILURE,
    NUMBERS_OF,
    PHI,
    ROW_A,
    ROW_B,
    SolvedPairs,
    UNIQUE,
    WORLD_AT,
)
from scene_graph_ros.geometry.spatial.vectors import (
    add,
    load_rotation,
    load_translation,
    relative_pose,
    rotate,
    rotate_inverse,
    scale,
    subtract,
)
from scene_graph_ros.geometry.tables.held_table import borrowed_table, HeldTable
from scene_graph_ros.geometry.tolerances import OSCULATION

__all__ = ["EXACT", "FIRST_PENETRATION", "PENETRATIONS", "WITHIN", "solve_pairs"]

WITHIN = 0
"""Keep pairs whose signed distance is at most ``max_distance``."""
PENETRATIONS = 1
"""Keep pairs deeper than OSCULATION times the larger of the two sizes."""
FIRST_PENETRATION = 2
"""As PENETRATIONS, and stop at the first."""

_NO_PAIRS = SolvedPairs(np.empty(0), 0, 0)

EXACT = Accuracy.EXACT.bound
"""Relative to the larger size: up to this accuracy, answers are polished to rounding."""


@inlined_kernel
def _store(numbers, at, v):
    """Write a vector from a place on."""
    numbers[at], numbers[at + 1], numbers[at + 2] = v


@lean_kernel
def _solve(places, X_WG, pairs, max_distance, keep, accuracy, points, numbers):
    """Write the kept pairs, as there is room; return how many, and which has no answer."""
    table = borrowed_table(places)
    m = len(numbers) // NUMBERS_OF[points]
    local, world = LOCAL_AT[points] * m, WORLD_AT[points] * m
    count = 0
    for k in range(pairs.shape[0]):
        row_A, row_B = pairs[k, 0], pairs[k, 1]
        turned = are_turned(table, row_A, row_B)
        i, j = (row_B, row_A) if turned else (row_A, row_B)
        R_WA, p_WA = load_rotation(X_WG, i), load_translation(X_WG, i)
        R_WB, p_WB = load_rotation(X_WG, j), load_translation(X_WG, j)
        R_AB, p_AB = relative_pose(R_WA, p_WA, R_WB, p_WB)
        size = max(table.scale[i], table.scale[j])
        phi, p_ACa, p_ACb, nhat_BA_A, unique, gap, decided_by = distance_pair(
            table, i, j, R_AB, p_AB, max_distance, accuracy * size
        )
        if math.isnan(phi):
            return count, k
        if keep == WITHIN:
            if phi > max_distance:
                continue
        elif phi >= -OSCULATION * size:
            continue
        numbers[ROW_A * m + count], numbers[ROW_B * m + count] = row_A, row_B
        numbers[PHI * m + count], numbers[GAP * m + count] = phi, gap
        numbers[UNIQUE * m + count], numbers[DECIDED_BY * m + count] = unique, decided_by
        at = 3 * count
        nhat_W = rotate(R_WA, nhat_BA_A)
        _store(numbers, NHAT_BA_W * m + at, scale(-1.0 if turned else 1.0, nhat_W))
        # Where the rows are turned, the first point is that of the pair's second geometry.
        first, second = (at + 3 * m, at) if turned else (at, at + 3 * m)
        if local:
            p_BCb = rotate_inverse(R_AB, subtract(p_ACb, p_AB))
            _store(numbers, local + first, p_ACa)
            _store(numbers, local + second, p_BCb)
        if world:
            _store(numbers, world + first, add(p_WA, rotate(R_WA, p_ACa)))
            _store(numbers, world + second, add(p_WA, rotate(R_WA, p_ACb)))
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
    points: int = BOTH,
) -> SolvedPairs:
    """Compute the signed distance of pairs of rows and keep those asked for, in their order.

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
        certify: fill ``gap`` for every pair, see ``certify_pairs``; otherwise it is the bound of
        the
            iterations, 0 where there are none. ``decided_by`` is filled always.
        points: LOCAL, WORLD or BOTH; with ``certify``, LOCAL ones are needed.

    """
    if not len(pairs):
        return _NO_PAIRS
    room = 1 if keep == FIRST_PENETRATION else len(pairs)
    numbers = np.empty(NUMBERS_OF[points] * room)
    loose = accuracy if accuracy > EXACT else 0.0
    count, failed = _solve(
        held.places, X_WG, pairs, float(max_distance), keep, loose, points, numbers
    )
    solved = SolvedPairs(numbers, room, count, failed, points)
    if certify:
        certify_pairs(
            held.table, X_WG, solved.rows, solved.distance, solved.p_ACa, solved.p_BCb,
            solved.nhat_BA_W, solved.gap,
        )  # fmt: skip
    return solved
