"""Points of inequalities in floats, proven by bounds of rounding, or left open.

A way to a point, or the simplex method (`active_set`), proposes; a point is tested against each
row, and multipliers that show that there is none are bounded (`basis_bounds`). A question left
open is for rational arithmetic.
"""

from __future__ import annotations

import numpy as np

from scene_graph_ros.convex.solve.floats.active_set import climb, OPTIMAL
from scene_graph_ros.convex.solve.floats.basis_bounds import (
    error_of_multipliers,
    inverse_error,
    multipliers_of,
    NONSINGULAR,
)
from scene_graph_ros.convex.solve.floats.unit_rows import holds, unit_rows
from scene_graph_ros.convex.solve.linear_algebra.doubled import exact_residuals
from scene_graph_ros.geometry.compiled.kernel import kernel
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = [
    "EMPTY",
    "OPEN",
    "POINT",
    "center_quickly",
    "deepest",
    "point_of_unit_rows",
    "point_quickly",
]

POINT, EMPTY, OPEN = 1, -1, 0
"""A point was shown, that there is none, or neither."""

_STEPS = 20
"""Steps of a walk for each row and variable."""

_MOST_RELAXATIONS = 8
"""Each costs as much as a step of the simplex method, which begins anew after them."""

_GAP = 1e-12
"""Of a radius: what it may be below its bound."""


@kernel
def deepest(columns, b, lengths, x, basis, inverse):
    """Move x ``(n + 1,)`` to the centre and radius of the largest ball in unit rows.

    Returns the status of the walk. Row m of the basis is a cap of the radius.
    """
    n, m = columns.shape
    cap, radius = 0.0, np.inf
    for i in range(m):
        cap = max(cap, abs(b[i]) / lengths[i])
        radius = min(radius, b[i] / lengths[i])
    cap = 2.0 * cap if cap > 0.0 else 1.0
    extended, sides = np.zeros((n + 1, m + 1)), np.empty(m + 1)
    extended[:n, :m] = columns
    extended[n, :m], sides[:m] = lengths, b
    extended[n, m], sides[m] = 1.0, cap
    x[:] = 0.0
    x[n] = radius
    goal, y, ray = np.zeros(n + 1), np.zeros(n + 1), np.zeros(n + 1)
    goal[n] = 1.0
    basis[:] = -1
    inverse[:] = np.eye(n + 1)
    steps = _STEPS * (m + n + 2)
    return climb(extended, sides, 0, m + 1, goal, x, basis, inverse, y, ray, steps)


@kernel
def _relax(columns, b, lengths, x):
    """Move x from row to row, the most broken one each time; tell whether none is broken then.

    As far behind each as it was before it (Motzkin and Schoenberg, "The relaxation method for
    linear inequalities", 1954). Most sets of some width are entered in few steps.
    """
    n, m = columns.shape
    rests = np.empty(m)
    for _ in range(_MOST_RELAXATIONS):
        rests[:] = b
        for k in range(n):
            column, at = columns[k], x[k]
            for i in range(m):
                rests[i] -= column[i] * at
        row, worst = -1, 0.0
        for i in range(m):
            if rests[i] < worst * lengths[i]:
                row, worst = i, rests[i] / lengths[i]
        if row < 0:
            return True
        for k in range(n):
            x[k] += 2.0 * worst / lengths[row] * columns[k, row]
    return False


@kernel
def point_of_unit_rows(rows, columns, sides, lengths, x):
    """Do the same as ``point_quickly`` for unit rows, also given as columns, from x on."""
    m, n = rows.shape
    if _relax(columns, sides, lengths, x) and holds(columns, sides, m, -1, x):
        return POINT
    center, basis, inverse = np.zeros(n + 1), np.empty(n + 1, np.int64), np.empty((n + 1, n + 1))
    deepest(columns, sides, lengths, center, basis, inverse)
    x[:] = center[:n]
    if center[n] >= 0.0:
        return POINT if holds(columns, sides, m, -1, x) else OPEN
    return EMPTY if _contradict(rows, sides, lengths, basis, inverse) else OPEN


@kernel
def point_quickly(A, b, x):
    """Fill a point ``(n,)`` of ``A x <= b``: POINT where it is shown, EMPTY where none is."""
    m, n = A.shape
    rows, sides, lengths = np.empty((m, n)), np.empty(m), np.empty(m)
    if n == 0 or m == 0 or not unit_rows(A, b, rows, sides, lengths):
        return OPEN
    x[:] = 0.0
    return point_of_unit_rows(rows, np.ascontiguousarray(rows.T), sides, lengths, x)


@kernel
def center_quickly(A, b, x):
    """Fill the centre ``(n,)`` of the largest ball in ``A x <= b``; tell whether that is shown.

    False where there may be no point, or balls as large as one likes, or where multipliers don't
    bound the radius by its value, to rounding.
    """
    m, n = A.shape
    rows, sides, lengths = np.empty((m, n)), np.empty(m), np.empty(m)
    if n == 0 or m == 0 or not unit_rows(A, b, rows, sides, lengths):
        return False
    columns = np.ascontiguousarray(rows.T)
    center, basis, inverse = np.zeros(n + 1), np.empty(n + 1, np.int64), np.empty((n + 1, n + 1))
    status = deepest(columns, sides, lengths, center, basis, inverse)
    x[:] = center[:n]
    if status != OPTIMAL or not center[n] > 0.0 or basis.max() >= m:
        return False
    rests, room = np.empty(m), np.empty(m)
    exact_residuals(columns, sides, m, x, rests, room)
    radius = (rests / lengths).min()
    extended, goal, y = np.empty((m, n + 1)), np.zeros(n + 1), np.empty(n + 1)
    extended[:, :n], extended[:, n], goal[n] = rows, lengths, 1.0
    multipliers_of(extended, basis, inverse, goal, y)
    # Weighted, the rows add up to nothing and their lengths to 1: no ball has a larger radius.
    bound = 0.0
    for j in range(n + 1):
        # Where balls are as large all along some way, there are places without rows.
        if basis[j] < 0 and abs(y[j]) > _GAP:
            return False
        bound += y[j] * rests[basis[j]] if basis[j] >= 0 else 0.0
    return bound - radius <= _GAP * radius and y.min() >= -_GAP


@kernel
def _contradict(rows, sides, lengths, basis, inverse):
    """Tell whether true multipliers of a basis of n + 1 rows surely show that there is no point.

    They have ``sum y a = 0`` and ``sum y length = 1`` for any rounding of the lengths, since
    these are one column of the system.
    """
    m, n = rows.shape
    extended = np.empty((m, n + 1))
    extended[:, :n] = rows
    extended[:, n] = lengths
    e = inverse_error(extended, basis, inverse)
    if e >= NONSINGULAR:
        return False
    goal, y = np.zeros(n + 1), np.empty(n + 1)
    goal[n] = 1.0
    multipliers_of(extended, basis, inverse, goal, y)
    left = np.empty(n + 1)
    for k in range(n + 1):
        total, size = goal[k], abs(goal[k])
        for j in range(n + 1):
            product = y[j] * extended[basis[j], k]
            total -= product
            size += abs(product)
        left[k] = abs(total) + (n + 4) * EPSILON * size
    error = error_of_multipliers(inverse, left, e)
    total, size = 0.0, 0.0
    for j in range(n + 1):
        if y[j] <= error:
            return False
        total += y[j] * sides[basis[j]]
        size += (y[j] * (n + 4) * EPSILON + error) * abs(sides[basis[j]])
    return total < -(1.0 + 4.0 * n * EPSILON) * size
