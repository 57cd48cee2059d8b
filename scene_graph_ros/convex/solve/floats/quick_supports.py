"""Supports of inequalities along directions, in floats with bounds of rounding."""

from __future__ import annotations

import numpy as np

from scene_graph_ros.convex.solve.floats.active_set import OPTIMAL
from scene_graph_ros.convex.solve.floats.basis_bounds import entry_of, multipliers_of
from scene_graph_ros.convex.solve.floats.quick_bounds import (
    maximize_from,
    positive_multipliers,
)
from scene_graph_ros.convex.solve.floats.row_tests import box_about, inner_point
from scene_graph_ros.convex.solve.floats.unit_rows import holds, unit_rows
from scene_graph_ros.convex.solve.linear_algebra.doubled import bounded_residuals, exact_residual
from scene_graph_ros.geometry.compiled.kernel import kernel
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = ["extents_quickly", "support_quickly", "supports_quickly"]

_ROUNDING = 16.0 * EPSILON
"""Relative to the largest multiplier: one below zero that is rounding."""


@kernel
def support_quickly(A, b, start, goal, x):
    """Move x to the largest goal in ``A x <= b``; return a bound of its shortfall.

    From a point ``start (n,)`` of the set. The gap is the multipliers' remainder of the slacks and
    of the goal; -1 where the reach may be without end, or no multipliers bound it.
    """
    m, n = A.shape
    rows, sides, lengths = np.empty((m, n)), np.empty(m), np.empty(m)
    if n == 0 or m == 0 or not unit_rows(A, b, rows, sides, lengths):
        return -1.0
    columns = np.ascontiguousarray(rows.T)
    x[:] = start
    if not holds(columns, sides, m, -1, x):
        return -1.0
    basis, inverse, y = np.full(n, -1), np.eye(n), np.empty(n)
    if maximize_from(columns, sides, m, goal, x, basis, inverse) != OPTIMAL:
        return -1.0
    multipliers_of(rows, basis, inverse, goal, y)
    least, rest, gap = -_ROUNDING * np.abs(y).max(), goal.copy(), 0.0
    for j in range(n):
        # Without a row at a place its multiplier is rounding, or the reach has no end.
        if y[j] < least or (basis[j] < 0 and abs(y[j]) > -least):
            return -1.0
        y[j] = max(y[j], 0.0) if basis[j] >= 0 else 0.0
        if basis[j] >= 0:
            gap += y[j] * abs(exact_residual(rows[basis[j]], x, sides[basis[j]]))
        for k in range(n):
            rest[k] -= y[j] * entry_of(rows, basis, j, k)
    for k in range(n):
        gap += abs(rest[k]) * max(abs(x[k]), abs(start[k]))
    return gap


@kernel
def supports_quickly(A, b, firsts, starts, goal, points, gaps):
    """Fill the points ``(m, n)`` of m sets furthest along a goal, and gaps ``(m,)``.

    Set s has the rows from ``firsts[s]`` to ``firsts[s + 1]`` and the point ``starts[s]``; gaps
    are those of `support_quickly`.
    """
    for s in range(len(starts)):
        own = slice(firsts[s], firsts[s + 1])
        gaps[s] = support_quickly(A[own], b[own], starts[s], goal, points[s])


@kernel
def _beyond_corner(goal, rows, sides, x, basis, y, reach):
    """Return an upper bound of ``goal . (z - x)`` at a corner x, for z within a reach of it.

    The products of multipliers y, at least 0, of the basis's rows and the slacks, and their
    remainder of the goal; both as if in twice the digits, so that simple numbers have no gap.
    """
    n = len(x)
    chosen, across, ends = np.zeros((n, n)), np.zeros((n, n)), np.zeros(n)
    for j in range(n):
        if basis[j] >= 0:
            ends[j] = sides[basis[j]]
            for k in range(n):
                chosen[j, k] = across[k, j] = rows[basis[j], k]
    slacks, rests, bounds, total = np.empty(n), np.empty(n), np.empty(n), 0.0
    bounded_residuals(across, ends, x, slacks, bounds)
    for j in range(n):
        total += y[j] * (abs(slacks[j]) + bounds[j])
    bounded_residuals(chosen, goal, y, rests, bounds)
    for k in range(n):
        total += (abs(rests[k]) + bounds[k]) * reach[k]
    return (1.0 + 4.0 * (n + 2) * EPSILON) * total


@kernel
def extents_quickly(A, b, low, high):
    """Fill the corners ``(n,)`` of a box that ``A x <= b`` is surely in, the least to rounding.

    False where the set may be empty, flat or unbounded.
    """
    m, n = A.shape
    rows, sides, lengths = np.empty((m, n)), np.empty(m), np.empty(m)
    if n == 0 or m == 0 or not unit_rows(A, b, rows, sides, lengths):
        return False
    columns = np.ascontiguousarray(rows.T)
    x0, slacks, widths = np.empty(n), np.empty(m), np.empty(n)
    if not inner_point(columns, sides, lengths, x0, slacks):
        return False
    if not box_about(rows, columns, slacks, widths):
        return False
    corners, y, goal, reach = np.empty((2 * n + 1, n)), np.empty(n), np.zeros(n), np.empty(n)
    bases, inverses = np.empty((2 * n + 1, n), np.int64), np.empty((2 * n + 1, n, n))
    corners[0], bases[0], inverses[0] = x0, -1, np.eye(n)
    for i in range(2 * n):
        k, sign = i % n, 1.0 if i < n else -1.0
        goal[:] = 0.0
        goal[k] = sign
        # From the corner that is furthest already.
        best = 0
        for c in range(1, i + 1):
            if sign * corners[c, k] > sign * corners[best, k]:
                best = c
        corners[i + 1], bases[i + 1], inverses[i + 1] = corners[best], bases[best], inverses[best]
        x, basis, inverse = corners[i + 1], bases[i + 1], inverses[i + 1]
        if maximize_from(columns, sides, m, goal, x, basis, inverse) != OPTIMAL:
            return False
        positive_multipliers(goal, rows, basis, inverse, y)
        for j in range(n):
            reach[j] = widths[j] + abs(x[j] - x0[j])
        end = x[k]
        beyond = _beyond_corner(goal, rows, sides, x, basis, y, reach)
        if beyond > 0.0:
            end += sign * (beyond + EPSILON * (abs(end) + beyond))
        if sign > 0.0:
            high[k] = end
        else:
            low[k] = end
    return True
