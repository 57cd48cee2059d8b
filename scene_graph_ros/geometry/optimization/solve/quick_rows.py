"""Which rows follow from others, and which sets are in others, in floats with bounds of rounding.

What `quick` says of points and multipliers. Each function answers for all rows or leaves all open.
"""

from __future__ import annotations

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import kernel
from scene_graph_ros.geometry.optimization.solve.active_set import exact_residual, OPTIMAL
from scene_graph_ros.geometry.optimization.solve.quick import (
    beyond,
    bounding_weights,
    deepest,
    half_widths,
    holds,
    maximize_from,
    OPEN,
    reach_bound,
    residual_error,
    unit_rows,
)
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = ["INSIDE", "OUTSIDE", "follow_quickly", "reduce_quickly"]

INSIDE, OUTSIDE = 1, -1
"""A row follows from others, or a point of theirs is beyond it."""

_INWARD = (0.0, 1e-14, 1e-12, 1e-9, 1e-6, 1e-3)
"""Shares of the way from an optimum back to an inner point: rounding leaves corners outside."""

_SURE = 16.0 * EPSILON
"""Relative to a side that is moved out by a tolerance: rounding of the sum."""


@kernel
def _slacks_at(A, b, x, slacks):
    """Fill slacks of rows at a point, rounded up; False unless all are surely positive."""
    for i in range(len(b)):
        rest = exact_residual(A[i], x, b[i])
        error = residual_error(A[i], x, b[i], rest)
        slacks[i] = rest + error
        if not rest > error:
            return False
    return True


@kernel
def _is_within(reach, row, x, side):
    """Tell whether a side is surely as far from a point of its row as a reach, or further."""
    rest = exact_residual(row, x, side)
    return reach <= rest - residual_error(row, x, side, rest) - 2.0 * EPSILON * abs(rest)


@kernel
def _moved(side, tol, length, sign):
    """Return a side moved out by a tolerance, rounded up or down."""
    out = side + tol * length
    return out + sign * _SURE * (abs(side) + abs(tol * length))


@kernel
def _shown_beyond(A, b, count, skip, far, x0, row, side):
    """Tell whether a point near to ``far`` surely fulfils all rows but one, and is beyond one."""
    z = np.empty(len(x0))
    for s in range(len(_INWARD)):
        for k in range(len(x0)):
            z[k] = far[k] + _INWARD[s] * (x0[k] - far[k])
        if not beyond(row, side, z):
            return False
        if holds(A, b, count, skip, z):
            return True
    return False


@kernel
def _box_about(A, slacks, widths):
    """Fill how far a set may reach from a point with these slacks; False where it may for ever."""
    n = A.shape[1]
    basis, inverse, y = np.empty(n, np.int64), np.empty((n, n)), np.empty(n)
    error = bounding_weights(A, basis, inverse, y)
    if error < 0.0:
        return False
    half_widths(A, slacks, basis, inverse, y, error, widths)
    return True


@kernel
def _inner_point(A, b, lengths, x0, slacks):
    """Fill a point that is surely inside, and its slacks; False where there may be none."""
    n = A.shape[1]
    center, basis = np.zeros(n + 1), np.empty(n + 1, np.int64)
    deepest(A, b, lengths, center, basis, np.empty((n + 1, n + 1)))
    x0[:] = center[:n]
    return center[n] > 0.0 and _slacks_at(A, b, x0, slacks)


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
    if not unit_rows(C, d, goals, limits, sizes):
        return
    if not _inner_point(rows, sides, lengths, x0, slacks):
        return
    rests = np.empty(len(d))
    for i in range(len(d)):
        rests[i] = exact_residual(goals[i], x0, limits[i]) / sizes[i]
    is_in_box = _box_about(rows, slacks, widths)
    x, basis, inverse, y = np.empty(n), np.empty(n, np.int64), np.empty((n, n)), np.empty(n)
    for i in np.argsort(rests):
        x[:] = x0
        if maximize_from(rows, sides, m, goals[i], x, basis, inverse) != OPTIMAL:
            continue
        above = _moved(limits[i], tol, sizes[i], 1.0)
        if _shown_beyond(rows, sides, m, -1, x, x0, goals[i], above):
            found[i] = OUTSIDE
            if ends_outside:
                return
            continue
        below = _moved(limits[i], tol, sizes[i], -1.0)
        reach = reach_bound(goals[i], rows, slacks, basis, inverse, widths, y)
        if is_in_box and _is_within(reach, goals[i], x0, below):
            found[i] = INSIDE


@kernel
def _meet_first(A, b, lengths, tol, x0, slacks, is_sure):
    """Mark rows that a ray from an inner point along a row's normal surely meets alone."""
    m, n = A.shape
    far = np.empty(n)
    for way in range(m):
        first, nearest, second = -1, np.inf, np.inf
        for i in range(m):
            rate = 0.0
            for k in range(n):
                rate += A[way, k] * A[i, k]
            if rate > 0.0:
                distance = slacks[i] / rate
                if distance < nearest:
                    first, nearest, second = i, distance, nearest
                elif distance < second:
                    second = distance
        if first < 0 or is_sure[first]:
            continue
        step = 0.5 * (nearest + min(second, 2.0 * nearest))
        for k in range(n):
            far[k] = x0[k] + step * A[way, k]
        above = _moved(b[first], tol, lengths[first], 1.0)
        if beyond(A[first], above, far) and holds(A, b, m, first, far):
            is_sure[first] = True


@kernel
def _is_implied(A, b, count, at, tol, length, x0, basis, inverse):
    """Propose whether the row at a place follows from the others before ``count``.

    1 if so, -1 where a point surely shows that not, 0 where neither.
    The row itself is moved out meanwhile, so that the set stays bounded.
    """
    x, side = x0.copy(), b[at]
    above = _moved(side, tol, length, 1.0)
    room = exact_residual(A[at], x0, side)
    b[at] = above + abs(above - side) + room
    status = maximize_from(A, b, count, A[at], x, basis, inverse)
    b[at] = side
    if status != OPTIMAL:
        return 0
    if exact_residual(A[at], x, above) >= 0.0:
        return 1
    return -1 if _shown_beyond(A, b, count, at, x, x0, A[at], above) else 0


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
    x0, slacks, widths = np.empty(n), np.empty(m), np.empty(n)
    if not _inner_point(rows, sides, lengths, x0, slacks):
        return False
    is_kept[:] = False
    _meet_first(rows, sides, lengths, tol, x0, slacks, is_kept)
    # Those there, in front of which those that were left out are not.
    there, right, names, place = rows.copy(), sides.copy(), np.arange(m), np.arange(m)
    count = m
    basis, inverse = np.empty(n, np.int64), np.empty((n, n))
    for i in range(m):
        if is_kept[i]:
            continue
        at = place[i]
        found = _is_implied(there, right, count, at, tol, lengths[i], x0, basis, inverse)
        if found == 0:
            return False
        if found < 0:
            is_kept[i] = True
            continue
        count -= 1
        there[at], right[at], names[at] = there[count], right[count], names[count]
        place[names[at]] = at
    return _follow(rows, sides, lengths, tol, x0, slacks, is_kept, widths)


@kernel
def _follow(rows, sides, lengths, tol, x0, slacks, is_kept, widths):
    """Tell whether all rows that are left out surely follow from those that stay."""
    m, n = rows.shape
    kept = np.flatnonzero(is_kept)
    some, right, some_slacks = rows[kept], sides[kept], slacks[kept]
    if not _box_about(some, some_slacks, widths):
        return False
    x, basis, inverse, y = np.empty(n), np.empty(n, np.int64), np.empty((n, n)), np.empty(n)
    for i in range(m):
        if is_kept[i]:
            continue
        x[:] = x0
        if maximize_from(some, right, len(kept), rows[i], x, basis, inverse) != OPTIMAL:
            return False
        below = _moved(sides[i], tol, lengths[i], -1.0)
        reach = reach_bound(rows[i], some, some_slacks, basis, inverse, widths, y)
        if not _is_within(reach, rows[i], x0, below):
            return False
    return True
