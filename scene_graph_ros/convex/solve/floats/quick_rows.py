"""Which rows follow from others, and which sets are in others, in floats with bounds of rounding.

Each row is answered for, or left open.
"""

from __future__ import annotations

import numpy as np

from scene_graph_ros.convex.solve.floats.active_set import OPTIMAL
from scene_graph_ros.convex.solve.floats.quick_bounds import (
    maximize_from,
    positive_multipliers,
    reach_bound,
)
from scene_graph_ros.convex.solve.floats.quick_points import OPEN
from scene_graph_ros.convex.solve.floats.row_tests import (
    box_about,
    inner_point,
    is_within,
    moved,
    shown_beyond,
)
from scene_graph_ros.convex.solve.floats.unit_rows import unit_rows
from scene_graph_ros.convex.solve.linear_algebra.doubled import exact_residual
from scene_graph_ros.geometry.compiled.kernel import kernel

__all__ = ["INSIDE", "OUTSIDE", "follow_quickly"]

INSIDE, OUTSIDE = 1, -1
"""A row follows from others, or a point of theirs is beyond it."""


@kernel
def follow_quickly(A, b, C, d, tol, ends_outside, found):
    """Fill for each row of ``C x <= d``, moved out, whether it follows from ``A x <= b``.

    INSIDE where it does, OUTSIDE where a point shows that it doesn't, OPEN where neither is shown.
    With ``ends_outside`` the first that doesn't ends the search, which is among the nearest first.
    """
    m, n = A.shape
    found[:] = OPEN
    rows, sides, lengths = np.empty((m, n)), np.empty(m), np.empty(m)
    goals, limits, sizes = np.empty(C.shape), np.empty(len(d)), np.empty(len(d))
    if n == 0 or m == 0 or not unit_rows(A, b, rows, sides, lengths):
        return
    x0, slacks, widths = np.empty(n), np.empty(m), np.empty(n)
    columns = np.ascontiguousarray(rows.T)
    if not unit_rows(C, d, goals, limits, sizes):
        return
    if not inner_point(columns, sides, lengths, x0, slacks):
        return
    rests = np.empty(len(d))
    for i in range(len(d)):
        rests[i] = exact_residual(goals[i], x0, limits[i]) / sizes[i]
    is_in_box = box_about(rows, columns, slacks, widths)
    x, basis, inverse, y = x0.copy(), np.full(n, -1), np.eye(n), np.empty(n)
    for i in np.argsort(rests):
        # From the corner where the goal before was largest.
        if maximize_from(columns, sides, m, goals[i], x, basis, inverse) != OPTIMAL:
            x[:] = x0
            basis[:] = -1
            inverse[:] = np.eye(n)
            continue
        above = moved(limits[i], tol, sizes[i], 1.0)
        if shown_beyond(columns, sides, m, -1, x, x0, goals[i], above):
            found[i] = OUTSIDE
            if ends_outside:
                return
            continue
        below = moved(limits[i], tol, sizes[i], -1.0)
        positive_multipliers(goals[i], rows, basis, inverse, y)
        reach = reach_bound(goals[i], rows, slacks, basis, widths, y)
        if is_in_box and is_within(reach, goals[i], x0, below):
            found[i] = INSIDE
