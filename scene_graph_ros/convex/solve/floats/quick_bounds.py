"""How far inequalities let points go, in floats with bounds of rounding.

Where a set is known to be within a box, multipliers need not be true ones: the rows' remainder of
the goal, times the box, bounds the rest (Neumaier and Shcherbina, "Safe bounds in linear and
mixed-integer linear programming", 2004).
"""

from __future__ import annotations

import math

import numpy as np

from scene_graph_ros.convex.solve.floats.active_set import climb, OPTIMAL
from scene_graph_ros.convex.solve.floats.basis_bounds import (
    entry_of,
    error_of_multipliers,
    inverse_error,
    multipliers_of,
    NONSINGULAR,
)
from scene_graph_ros.convex.solve.floats.unit_rows import unit_rows
from scene_graph_ros.geometry.compiled.kernel import kernel
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = [
    "bounding_weights",
    "half_widths",
    "is_bounded_quickly",
    "maximize_from",
    "positive_multipliers",
    "reach_bound",
]

_STEPS = 20
"""Steps of a walk for each row and variable."""


@kernel
def _weight(i):
    """Return a row's weight between 1 and 2, none like another, so that few sums are nothing."""
    return 1.0 + i * 0.6180339887 - math.floor(i * 0.6180339887)


@kernel
def bounding_weights(A, columns, basis, inverse, y):
    """Fill a basis and multipliers that show that unit rows bound a set; return their error.

    With `_weight` of all rows and ``y`` besides of the basis's, all of them positive, the rows
    add up to nothing, so that no direction breaks none (Stiemke 1915). -1 where that isn't shown.
    """
    m, n = A.shape
    goal, sides = np.zeros(n), np.empty(m)
    for i in range(m):
        sides[i] = _weight(i)
        for k in range(n):
            goal[k] -= _weight(i) * A[i, k]
    x, ray = np.zeros(n), np.zeros(n)
    basis[:] = -1
    inverse[:] = np.eye(n)
    steps = _STEPS * (m + n + 1)
    if climb(columns, sides, 0, m, goal, x, basis, inverse, y, ray, steps) != OPTIMAL:
        return -1.0
    e = inverse_error(A, basis, inverse)
    if e >= NONSINGULAR:
        return -1.0
    multipliers_of(A, basis, inverse, goal, y)
    left = np.empty(n)
    for k in range(n):
        total, size = 0.0, 0.0
        for i in range(m):
            total += _weight(i) * A[i, k]
            size += abs(_weight(i) * A[i, k])
        for j in range(n):
            product = y[j] * A[basis[j], k]
            total += product
            size += abs(product)
        left[k] = abs(total) + (m + n + 4) * EPSILON * size
    error = error_of_multipliers(inverse, left, e)
    return error if y.min() - error > -NONSINGULAR else -1.0


@kernel
def half_widths(A, slacks, basis, inverse, y, error, widths):
    """Fill how far a set may reach ``(n,)`` along each axis from a point with these slacks.

    Weighted slacks of all points have the same sum, so that each is at most this over its weight.
    """
    m, n = A.shape
    total = 0.0
    for i in range(m):
        total += _weight(i) * slacks[i]
    least = 1.0
    for j in range(n):
        total += (abs(y[j]) + error) * slacks[basis[j]]
        least = min(least, 1.0 + y[j] - error)
    largest = (1.0 + 4.0 * (m + n) * EPSILON) * total / least
    e = inverse_error(A, basis, inverse)
    for k in range(n):
        reach = 0.0
        for j in range(n):
            reach += abs(inverse[k, j])
        widths[k] = (1.0 + 8.0 * n * EPSILON) * reach * largest / (1.0 - e)


@kernel
def is_bounded_quickly(A):
    """Tell whether ``A x <= b`` is surely bounded, for any b; False leaves it open."""
    m, n = A.shape
    rows, sides, lengths = np.empty((m, n)), np.empty(m), np.empty(m)
    if n == 0 or not unit_rows(A, np.zeros(m), rows, sides, lengths):
        return False
    basis, inverse, y = np.empty(n, np.int64), np.empty((n, n)), np.empty(n)
    columns = np.ascontiguousarray(rows.T)
    return bounding_weights(rows, columns, basis, inverse, y) >= 0.0


@kernel
def positive_multipliers(goal, A, basis, inverse, y):
    """Fill multipliers y ``(n,)`` of a basis's rows for a goal, none of them below 0."""
    multipliers_of(A, basis, inverse, goal, y)
    for j in range(len(y)):
        y[j] = max(y[j], 0.0) if basis[j] >= 0 else 0.0


@kernel
def reach_bound(goal, A, slacks, basis, widths, y):
    """Return an upper bound of ``goal . (x - x0)`` in a set within half widths of x0.

    ``slacks (m,)`` are those of x0, none too small, and multipliers y ``(n,)`` of the basis's rows
    at least 0.
    """
    n = len(goal)
    total = 0.0
    for j in range(n):
        if basis[j] >= 0:
            total += y[j] * slacks[basis[j]]
    rests, sizes = goal.copy(), np.abs(goal)
    for j in range(n):
        for k in range(n):
            product = y[j] * entry_of(A, basis, j, k)
            rests[k] -= product
            sizes[k] += abs(product)
    for k in range(n):
        total += (abs(rests[k]) + (n + 4) * EPSILON * sizes[k]) * widths[k]
    return (1.0 + 4.0 * (n + 2) * EPSILON) * total


@kernel
def maximize_from(columns, b, count, goal, x, basis, inverse):
    """Walk from x, a point of the first ``count`` rows, to where a goal is largest."""
    n = len(x)
    y, ray = np.zeros(n), np.zeros(n)
    steps = _STEPS * (count + n + 1)
    return climb(columns, b, 0, count, goal, x, basis, inverse, y, ray, steps)
