"""Which rows of a polyhedron can be left out, in floats with bounds of rounding, or left open.

Rows that rays from an inner point meet alone are needed. Whether those imply another row is a
program of them alone; where they don't, the way to its optimum meets one that is needed and was
not known (Clarkson, "More output-sensitive geometric algorithms", FOCS 1994, section 2). Where
rows are equal, or nearly, none of them is met alone: they are left out in turn.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scene_graph_ros.convex.solve.floats.active_set import OPTIMAL
from scene_graph_ros.convex.solve.floats.leaving_out import leave_out
from scene_graph_ros.convex.solve.floats.quick_bounds import (
    maximize_from,
    positive_multipliers,
    reach_bound,
)
from scene_graph_ros.convex.solve.floats.rays import Body, shoot, turn
from scene_graph_ros.convex.solve.floats.row_tests import (
    box_about,
    inner_point,
    is_within,
    moved,
)
from scene_graph_ros.convex.solve.floats.unit_rows import unit_rows
from scene_graph_ros.convex.solve.linear_algebra.doubled import exact_residual
from scene_graph_ros.geometry.compiled.kernel import kernel, lean_kernel

__all__ = ["reduce_quickly"]

_MOST_CORNERS = 32
"""Corners that are remembered to begin walks at."""

_TURNS = 2
"""Turns of a ray towards a row, for each variable, before a program is solved."""

_MOST_LOST = 2
"""Rows that rays were turned to in vain, less those found: beyond it programs are quicker."""


class _Needed(NamedTuple):
    """Rows that are needed, as far as they are known, and corners of their polyhedron.

    ``rows (m + 1, n)``, columns, sides and slacks have room for one more; ``counts`` are how many
    rows and corners there are. ``inverses (c, n, n)`` are those of the corners' bases; behind them
    are those of the present walk, a ray's way, and how many more rows rays were turned to in vain
    than were found, ``(1,)``.
    """

    rows: np.ndarray
    columns: np.ndarray
    sides: np.ndarray
    slacks: np.ndarray
    is_there: np.ndarray
    counts: np.ndarray
    corners: np.ndarray
    bases: np.ndarray
    inverses: np.ndarray
    x: np.ndarray
    basis: np.ndarray
    inverse: np.ndarray
    way: np.ndarray
    lost: np.ndarray


@lean_kernel
def _put(needed, row, side):
    """Write a row with a right side behind those that are needed."""
    place = needed.counts[0]
    needed.sides[place] = side
    for k in range(len(row)):
        needed.rows[place, k] = needed.columns[k, place] = row[k]


@lean_kernel
def _write(needed, place, x, basis, inverse):
    """Write a corner with its basis at a place of those that are remembered."""
    n = len(x)
    for k in range(n):
        needed.corners[place, k], needed.bases[place, k] = x[k], basis[k]
        for j in range(n):
            needed.inverses[place, k, j] = inverse[k, j]


@lean_kernel
def _add_sure(body, is_sure, needed):
    """Add the rows that were marked meanwhile, and forget corners that they cut off."""
    counts, corners = needed.counts, needed.corners
    for i in range(len(is_sure)):
        if not is_sure[i] or needed.is_there[i]:
            continue
        needed.is_there[i] = True
        _put(needed, body.rows[i], body.sides[i])
        needed.slacks[counts[0]] = body.slacks[i]
        counts[0] += 1
        left = 0
        for c in range(counts[1]):
            if exact_residual(body.rows[i], corners[c], body.sides[i]) >= 0.0:
                _write(needed, left, corners[c], needed.bases[c], needed.inverses[c])
                left += 1
        counts[1] = left


@lean_kernel
def _keep_corner(needed):
    """Remember the corner of the last walk with its basis, while there is room."""
    c = needed.counts[1]
    if c < _MOST_CORNERS:
        _write(needed, c, needed.x, needed.basis, needed.inverse)
        needed.counts[1] += 1


@lean_kernel
def _start(goal, body, needed):
    """Begin at the corner where a goal is largest, or at the inner point where there is none."""
    n = len(goal)
    best, height = -1, -np.inf
    for c in range(needed.counts[1]):
        total = 0.0
        for k in range(n):
            total += goal[k] * needed.corners[c, k]
        if total > height:
            best, height = c, total
    for k in range(n):
        needed.x[k] = needed.corners[best, k] if best >= 0 else body.x0[k]
        needed.basis[k] = needed.bases[best, k] if best >= 0 else -1
        for j in range(n):
            unit = 1.0 if j == k else 0.0
            needed.inverse[k, j] = needed.inverses[best, k, j] if best >= 0 else unit
    return best >= 0


@lean_kernel
def _is_highest(goal, inverse):
    """Tell whether no edge of a corner leads up."""
    n = len(goal)
    for j in range(n):
        weight = 0.0
        for k in range(n):
            weight += goal[k] * inverse[k, j]
        if not weight >= 0.0:
            return False
    return True


@lean_kernel
def _shoot_towards(body, i, is_sure, way):
    """Turn a ray towards a row, and mark the rows that it meets on the way."""
    for k in range(len(way)):
        way[k] = body.rows[i, k]
    for _ in range(_TURNS * len(way)):
        first, _ = shoot(body, way, is_sure)
        if first < 0 or first == i:
            break
        turn(body, i, first, way)


@lean_kernel
def _settle_row(body, i, is_sure, needed, y, proof):
    """Mark a row, or fill multipliers of needed rows, by whose places they are, that imply it.

    False where neither is found.
    """
    n = len(y)
    row, side = body.rows[i], body.sides[i]
    above = moved(side, body.tol, body.lengths[i], 1.0)
    x, basis, inverse, way = needed.x, needed.basis, needed.inverse, needed.way
    has_turned = needed.lost[0] > _MOST_LOST
    for _ in range(len(is_sure) + 2):
        _add_sure(body, is_sure, needed)
        if is_sure[i]:
            return True
        has_corner = _start(row, body, needed)
        is_beyond = has_corner and exact_residual(row, x, above) < 0.0
        is_optimal = has_corner and not is_beyond and _is_highest(row, inverse)
        if not (is_beyond or is_optimal or has_turned):
            has_turned = True
            _shoot_towards(body, i, is_sure, way)
            needed.lost[0] += -1 if is_sure[i] else 1
            continue
        if not (is_beyond or is_optimal):
            # The row itself ends the walk beyond it.
            _put(needed, row, above + abs(above - side) + body.slacks[i])
            count = needed.counts[0] + 1
            if (
                maximize_from(needed.columns, needed.sides, count, row, x, basis, inverse)
                != OPTIMAL
            ):
                return False
            is_beyond = exact_residual(row, x, above) < 0.0
            if not is_beyond:
                _keep_corner(needed)
        if not is_beyond:
            positive_multipliers(row, needed.rows, basis, inverse, y)
            for k in range(n):
                proof[k] = basis[k]
            return True
        # The way there meets a row that is needed and was not known, or the search ends.
        for k in range(n):
            way[k] = x[k] - body.x0[k]
        if not shoot(body, way, is_sure)[1]:
            break
    return False


@kernel
def _divide(body, is_sure):
    """Mark the rows that are needed, and tell whether the others surely follow from them.

    False where that is not shown of a row; those that are marked are needed in any case.
    """
    m, n = body.rows.shape
    needed = _Needed(
        np.empty((m + 1, n)),
        np.empty((n, m + 1)),
        np.empty(m + 1),
        np.empty(m),
        np.zeros(m, np.bool_),
        np.zeros(2, np.int64),
        np.empty((_MOST_CORNERS, n)),
        np.empty((_MOST_CORNERS, n), np.int64),
        np.empty((_MOST_CORNERS, n, n)),
        np.empty(n),
        np.empty(n, np.int64),
        np.empty((n, n)),
        np.empty(n),
        np.zeros(1, np.int64),
    )
    ys, proofs = np.empty((m, n)), np.empty((m, n), np.int64)
    for i in range(m):
        if not _settle_row(body, i, is_sure, needed, ys[i], proofs[i]):
            return False
    widths, count = np.empty(n), needed.counts[0]
    kept, slacks = needed.rows[:count].copy(), needed.slacks[:count].copy()
    if not box_about(kept, np.ascontiguousarray(kept.T), slacks, widths):
        return False
    for i in range(m):
        if not is_sure[i]:
            below = moved(body.sides[i], body.tol, body.lengths[i], -1.0)
            reach = reach_bound(body.rows[i], kept, slacks, proofs[i], widths, ys[i])
            if not is_within(reach, body.rows[i], body.x0, below):
                return False
    return True


@kernel
def reduce_quickly(A, b, tol, is_kept):
    """Mark the rows that stay if each that the others there imply is left out, one by one.

    True where each that stays is shown to cut off a point alone, and each other is shown to follow
    from those that stay.
    """
    m, n = A.shape
    rows, sides, lengths = np.empty((m, n)), np.empty(m), np.empty(m)
    if n == 0 or m < 2 or not unit_rows(A, b, rows, sides, lengths):
        return False
    columns = np.ascontiguousarray(rows.T)
    x0, slacks = np.empty(n), np.empty(m)
    if not inner_point(columns, sides, lengths, x0, slacks):
        return False
    body = Body(rows, columns, sides, lengths, tol, x0, slacks, np.empty(m), np.empty(n))
    is_kept[:] = False
    for i in range(m):
        shoot(body, rows[i], is_kept)
    return _divide(body, is_kept) or leave_out(body, is_kept)
