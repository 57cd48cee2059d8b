"""Bounds of errors of the multipliers of a basis.

They solve a square system; with the approximate inverse R of the basis B and ``E = I - B R`` the
true ones are within ``|R' rest| / (1 - |E|)`` of those found (Rump, "Verification methods", Acta
Numerica 19, 2010, section 10).
"""

from __future__ import annotations

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import kernel
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = ["NONSINGULAR", "entry_of", "error_of_multipliers", "inverse_error", "multipliers_of"]

NONSINGULAR = 0.5
"""Of ``|I - B R|``: below it the basis is surely one, and bounds are within a factor of 2."""


@kernel
def inverse_error(A, basis, inverse):
    """Return a bound of ``|I - B R|`` by rows and columns, 1 where places are no rows of A."""
    n = inverse.shape[0]
    m = A.shape[0]
    of_rows, of_columns = np.zeros(n), np.zeros(n)
    totals, sizes = np.empty(n), np.empty(n)
    for i in range(n):
        if basis[i] < 0 or basis[i] >= m:
            return 1.0
        totals[:] = 0.0
        sizes[:] = 1.0
        for k in range(n):
            entry = A[basis[i], k]
            for j in range(n):
                product = entry * inverse[k, j]
                totals[j] += product
                sizes[j] += abs(product)
        totals[i] -= 1.0
        for j in range(n):
            error = abs(totals[j]) + (n + 3) * EPSILON * sizes[j]
            of_rows[i] += error
            of_columns[j] += error
    return (1.0 + 4.0 * n * EPSILON) * max(of_rows.max(), of_columns.max())


@kernel
def entry_of(A, basis, j, k):
    """Return an entry of a basis: places that are -1 hold unit vectors."""
    if basis[j] >= 0:
        return A[basis[j], k]
    return 1.0 if j == k else 0.0


@kernel
def multipliers_of(A, basis, inverse, goal, y):
    """Fill multipliers ``(n,)`` of a basis's rows for a goal, with one step of refinement."""
    n = len(goal)
    rest = goal.copy()
    y[:] = 0.0
    for step in range(2):
        for k in range(n):
            left = rest[k]
            for j in range(n):
                y[j] += left * inverse[k, j]
        if step == 0:
            for k in range(n):
                rest[k] = goal[k]
            for j in range(n):
                for k in range(n):
                    rest[k] -= y[j] * entry_of(A, basis, j, k)


@kernel
def error_of_multipliers(inverse, left, e):
    """Return a bound of the errors of multipliers, from that of the goal's remainder."""
    n = len(left)
    largest = 0.0
    for j in range(n):
        total = 0.0
        for k in range(n):
            total += abs(inverse[k, j]) * left[k]
        largest = max(largest, total)
    return (1.0 + 8.0 * n * EPSILON) * largest / (1.0 - e)
