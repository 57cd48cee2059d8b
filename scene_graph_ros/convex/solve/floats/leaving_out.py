"""Rows that are left out one after the other, where those still there imply them.

In floats with bounds of rounding, or left open; for rows that are equal, or nearly, of which none
is needed for itself.
"""

from __future__ import annotations

import numpy as np

from scene_graph_ros.convex.solve.floats.active_set import OPTIMAL
from scene_graph_ros.convex.solve.floats.quick_bounds import (
    maximize_from,
    positive_multipliers,
    reach_bound,
)
from scene_graph_ros.convex.solve.floats.row_tests import (
    box_about,
    is_within,
    moved,
    shown_beyond,
)
from scene_graph_ros.convex.solve.linear_algebra.doubled import exact_residual
from scene_graph_ros.geometry.compiled.kernel import kernel

__all__ = ["leave_out"]


@kernel
def leave_out(body, is_kept):
    """Mark the rows that stay if those that aren't marked are left out in turn where implied.

    True where each that is left out is shown to follow from those that stay.
    """
    rows, sides = body.rows, body.sides
    m = len(sides)
    # Those there, in front of which those that were left out are not.
    there, right, names, place = body.columns.copy(), sides.copy(), np.arange(m), np.arange(m)
    count = m
    for i in range(m):
        if is_kept[i]:
            continue
        at = place[i]
        found = _is_implied(there, right, count, at, rows[i], body.tol, body.lengths[i], body.x0)
        if found == 0:
            return False
        if found < 0:
            is_kept[i] = True
            continue
        count -= 1
        there[:, at], right[at], names[at] = there[:, count], right[count], names[count]
        place[names[at]] = at
    return _follow(body, is_kept)


@kernel
def _is_implied(columns, b, count, at, row, tol, length, x0):
    """Propose whether the row at a place follows from the others before ``count``.

    1 if so, -1 where a point surely shows that not, 0 where neither.
    The row itself is moved out meanwhile, so that the set stays bounded.
    """
    n = len(x0)
    x, basis, inverse, side = x0.copy(), np.full(n, -1), np.eye(n), b[at]
    above = moved(side, tol, length, 1.0)
    room = exact_residual(row, x0, side)
    b[at] = above + abs(above - side) + room
    status = maximize_from(columns, b, count, row, x, basis, inverse)
    b[at] = side
    if status != OPTIMAL:
        return 0
    if exact_residual(row, x, above) >= 0.0:
        return 1
    return -1 if shown_beyond(columns, b, count, at, x, x0, row, above) else 0


@kernel
def _follow(body, is_kept):
    """Tell whether all rows that are left out surely follow from those that stay."""
    m, n = body.rows.shape
    kept = np.flatnonzero(is_kept)
    some, right, some_slacks = body.rows[kept], body.sides[kept], body.slacks[kept]
    columns, widths = np.ascontiguousarray(some.T), np.empty(n)
    if not box_about(some, columns, some_slacks, widths):
        return False
    x, basis, inverse, y = body.x0.copy(), np.full(n, -1), np.eye(n), np.empty(n)
    for i in range(m):
        if is_kept[i]:
            continue
        row = body.rows[i]
        if maximize_from(columns, right, len(kept), row, x, basis, inverse) != OPTIMAL:
            return False
        below = moved(body.sides[i], body.tol, body.lengths[i], -1.0)
        positive_multipliers(row, some, basis, inverse, y)
        reach = reach_bound(row, some, some_slacks, basis, widths, y)
        if not is_within(reach, row, body.x0, below):
            return False
    return True
