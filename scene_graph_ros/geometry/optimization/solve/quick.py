"""Decisions about inequalities in floats alone, proven by bounds of rounding, or left open.

The simplex method (`active_set`) proposes a point, a direction or multipliers. A point is tested
against each row in doubled precision. Multipliers of a basis B solve a square system; with its
approximate inverse R and ``E = I - B R`` the true ones are within ``|R' rest| / (1 - |E|)`` of
those found (Rump, "Verification methods", Acta Numerica 19, 2010, section 10). Where a set is
known to be within a box, multipliers need not be true ones: what the rows leave of the goal, times
the box, bounds the rest (Neumaier and Shcherbina, "Safe bounds in linear and mixed-integer linear
programming", 2004). What is left open is for rational arithmetic.
"""

from __future__ import annotations

import math

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import kernel
from scene_graph_ros.geometry.optimization.solve.active_set import climb, exact_residual, OPTIMAL
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = [
    "EMPTY",
    "OPEN",
    "POINT",
    "beyond",
    "bounding_weights",
    "deepest",
    "half_widths",
    "holds",
    "is_bounded_quickly",
    "maximize_from",
    "point_quickly",
    "reach_bound",
    "residual_error",
    "unit_rows",
]

POINT, EMPTY, OPEN = 1, -1, 0
"""A point was shown, that there is none, or neither."""

_LARGEST, _LEAST = 1e140, 1e-140
"""Lengths of rows between which powers of two change no digit."""

_UNDERFLOW = 1e-290
"""Entries below it may have lost digits."""

_STEPS = 20
"""Steps of a walk for each row and variable."""

_NONSINGULAR = 0.5
"""Of ``|I - B R|``: below it the basis is surely one, and bounds are within a factor of 2."""


@kernel
def unit_rows(A, b, rows, sides, lengths):
    """Fill rows with lengths between 1/2 and 1, by powers of two; False where one has none."""
    m, n = A.shape
    for i in range(m):
        square = 0.0
        for k in range(n):
            square += A[i, k] * A[i, k]
        length = math.sqrt(square)
        if not _LEAST < length < _LARGEST:
            return False
        _, exponent = math.frexp(length)
        factor = math.ldexp(1.0, -exponent)
        for k in range(n):
            rows[i, k] = A[i, k] * factor
            if A[i, k] != 0.0 and abs(rows[i, k]) < _UNDERFLOW:
                return False
        sides[i] = b[i] * factor
        if b[i] != 0.0 and not _UNDERFLOW < abs(sides[i]) < 1.0 / _UNDERFLOW:
            return False
        lengths[i] = length * factor
    return True


@kernel
def residual_error(row, x, side, rest):
    """Return what `exact_residual` may be off by (Ogita, Rump and Oishi 2005, proposition 5.5)."""
    n = len(x)
    size = abs(side)
    for k in range(n):
        size += abs(row[k] * x[k])
    return 2.0 * EPSILON * abs(rest) + 2.0 * (n + 1) ** 2 * EPSILON**2 * size


@kernel
def holds(A, b, count, skip, x):
    """Tell whether x surely fulfils the first ``count`` rows but one, or leave it open."""
    for i in range(count):
        if i != skip:
            rest = exact_residual(A[i], x, b[i])
            if not rest >= residual_error(A[i], x, b[i], rest):
                return False
    return True


@kernel
def beyond(row, side, x):
    """Tell whether x is surely beyond a row."""
    rest = exact_residual(row, x, side)
    return rest < -residual_error(row, x, side, rest)


@kernel
def deepest(A, b, lengths, x, basis, inverse):
    """Move x ``(n + 1,)`` to the centre and radius of the largest ball in unit rows."""
    m, n = A.shape
    cap, radius = 0.0, np.inf
    for i in range(m):
        cap = max(cap, abs(b[i]) / lengths[i])
        radius = min(radius, b[i] / lengths[i])
    cap = 2.0 * cap if cap > 0.0 else 1.0
    rows, sides = np.empty((m + 1, n + 1)), np.empty(m + 1)
    for i in range(m):
        for k in range(n):
            rows[i, k] = A[i, k]
        rows[i, n], sides[i] = lengths[i], b[i]
    rows[m, :n] = 0.0
    rows[m, n], sides[m] = 1.0, cap
    x[:] = 0.0
    x[n] = radius
    goal, y, ray = np.zeros(n + 1), np.zeros(n + 1), np.zeros(n + 1)
    goal[n] = 1.0
    basis[:] = -1
    inverse[:] = np.eye(n + 1)
    return climb(rows, sides, 0, goal, x, basis, inverse, y, ray, _STEPS * (m + n + 2))


@kernel
def inverse_error(A, basis, inverse):
    """Return a bound of ``|I - B R|`` by rows and columns, 1 where places are no rows of A."""
    n = inverse.shape[0]
    m = A.shape[0]
    of_rows, of_columns = np.zeros(n), np.zeros(n)
    for i in range(n):
        if basis[i] < 0 or basis[i] >= m:
            return 1.0
        for j in range(n):
            total, size = 0.0, 0.0
            for k in range(n):
                product = A[basis[i], k] * inverse[k, j]
                total += product
                size += abs(product)
            if i == j:
                total -= 1.0
            error = abs(total) + (n + 2) * EPSILON * (size + 1.0)
            of_rows[i] += error
            of_columns[j] += error
    return (1.0 + 4.0 * n * EPSILON) * max(of_rows.max(), of_columns.max())


@kernel
def _entry(A, basis, j, k):
    """Return an entry of a basis: places that are -1 hold unit vectors."""
    if basis[j] >= 0:
        return A[basis[j], k]
    return 1.0 if j == k else 0.0


@kernel
def _multipliers(A, basis, inverse, goal, y):
    """Fill multipliers ``(n,)`` of a basis's rows for a goal, with one step of refinement."""
    n = len(goal)
    rest = goal.copy()
    y[:] = 0.0
    for _ in range(2):
        for j in range(n):
            for k in range(n):
                y[j] += inverse[k, j] * rest[k]
        for k in range(n):
            total = goal[k]
            for j in range(n):
                total -= y[j] * _entry(A, basis, j, k)
            rest[k] = total


@kernel
def _error_of_multipliers(inverse, left, e):
    """Return by how much true multipliers may differ, of what is left of the goal at most."""
    n = len(left)
    largest = 0.0
    for j in range(n):
        total = 0.0
        for k in range(n):
            total += abs(inverse[k, j]) * left[k]
        largest = max(largest, total)
    return (1.0 + 8.0 * n * EPSILON) * largest / (1.0 - e)


@kernel
def point_quickly(A, b, x):
    """Fill a point ``(n,)`` of ``A x <= b``: POINT where it is shown, EMPTY where none is."""
    m, n = A.shape
    rows, sides, lengths = np.empty((m, n)), np.empty(m), np.empty(m)
    if n == 0 or m == 0 or not unit_rows(A, b, rows, sides, lengths):
        return OPEN
    center, basis = np.zeros(n + 1), np.empty(n + 1, np.int64)
    inverse = np.empty((n + 1, n + 1))
    deepest(rows, sides, lengths, center, basis, inverse)
    x[:] = center[:n]
    if center[n] >= 0.0 and holds(rows, sides, m, -1, x):
        return POINT
    if center[n] >= 0.0:
        return OPEN
    return EMPTY if _contradict(rows, sides, lengths, basis, inverse) else OPEN


@kernel
def _contradict(rows, sides, lengths, basis, inverse):
    """Tell whether true multipliers of a basis of n + 1 rows surely show that there is no point.

    They have ``sum y a = 0`` and ``sum y length = 1`` whatever the lengths are rounded to, since
    these are one column of the system.
    """
    m, n = rows.shape
    extended = np.empty((m, n + 1))
    extended[:, :n] = rows
    extended[:, n] = lengths
    e = inverse_error(extended, basis, inverse)
    if e >= _NONSINGULAR:
        return False
    goal, y = np.zeros(n + 1), np.empty(n + 1)
    goal[n] = 1.0
    _multipliers(extended, basis, inverse, goal, y)
    left = np.empty(n + 1)
    for k in range(n + 1):
        total, size = goal[k], abs(goal[k])
        for j in range(n + 1):
            product = y[j] * extended[basis[j], k]
            total -= product
            size += abs(product)
        left[k] = abs(total) + (n + 4) * EPSILON * size
    error = _error_of_multipliers(inverse, left, e)
    total, size = 0.0, 0.0
    for j in range(n + 1):
        if y[j] <= error:
            return False
        total += y[j] * sides[basis[j]]
        size += (y[j] * (n + 4) * EPSILON + error) * abs(sides[basis[j]])
    return total < -(1.0 + 4.0 * n * EPSILON) * size


@kernel
def _weight(i):
    """Return a row's weight between 1 and 2, none like another, so that few sums are nothing."""
    return 1.0 + i * 0.6180339887 - math.floor(i * 0.6180339887)


@kernel
def bounding_weights(A, basis, inverse, y):
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
    if climb(A, sides, 0, goal, x, basis, inverse, y, ray, _STEPS * (m + n + 1)) != OPTIMAL:
        return -1.0
    e = inverse_error(A, basis, inverse)
    if e >= _NONSINGULAR:
        return -1.0
    _multipliers(A, basis, inverse, goal, y)
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
    error = _error_of_multipliers(inverse, left, e)
    return error if y.min() - error > -_NONSINGULAR else -1.0


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
    """Tell whether ``A x <= b`` is surely bounded, whatever b is; False leaves it open."""
    m, n = A.shape
    rows, sides, lengths = np.empty((m, n)), np.empty(m), np.empty(m)
    if n == 0 or not unit_rows(A, np.zeros(m), rows, sides, lengths):
        return False
    basis, inverse, y = np.empty(n, np.int64), np.empty((n, n)), np.empty(n)
    return bounding_weights(rows, basis, inverse, y) >= 0.0


@kernel
def reach_bound(goal, A, slacks, basis, inverse, widths, y):
    """Return what ``goal . (x - x0)`` is at most in a set within half widths of x0.

    ``slacks (m,)`` are those of x0, none too small. Fills the multipliers y ``(n,)``, at least 0.
    """
    n = len(goal)
    _multipliers(A, basis, inverse, goal, y)
    total = 0.0
    for j in range(n):
        y[j] = max(y[j], 0.0) if basis[j] >= 0 else 0.0
        if basis[j] >= 0:
            total += y[j] * slacks[basis[j]]
    for k in range(n):
        rest, size = goal[k], abs(goal[k])
        for j in range(n):
            product = y[j] * _entry(A, basis, j, k)
            rest -= product
            size += abs(product)
        total += (abs(rest) + (n + 4) * EPSILON * size) * widths[k]
    return (1.0 + 4.0 * (n + 2) * EPSILON) * total


@kernel
def maximize_from(A, b, count, goal, x, basis, inverse):
    """Walk from x, a point of the first ``count`` rows, to where a goal is largest."""
    n = len(x)
    y, ray = np.zeros(n), np.zeros(n)
    basis[:] = -1
    inverse[:] = np.eye(n)
    steps = _STEPS * (count + n + 1)
    return climb(A[:count], b[:count], 0, goal, x, basis, inverse, y, ray, steps)
