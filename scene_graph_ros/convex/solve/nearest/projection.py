"""The nearest point of a polyhedron: the dual method of Goldfarb and Idnani (1983).

It starts at the point itself and adds the row that is broken most, so it needs no point of the
set. The normals of the active rows are kept as an orthonormal basis times a triangle.
"""

from __future__ import annotations

import numpy as np

from scene_graph_ros.convex.solve.linear_algebra.doubled import exact_residual, exact_residuals
from scene_graph_ros.geometry.compiled.kernel import kernel
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = ["project_points"]

_DEPENDENT = 1e-13
"""Relative to its length: what is left of a row beside the active ones, if it depends on them."""

_INSIDE = 4.0 * EPSILON
"""Relative to the numbers in a row: a row broken by less holds to rounding."""

_NO_WEIGHT = 1e-12
"""Of unit rows: the weight of one in another that is rounding."""

_ROUNDING = 1e-10
"""Relative to the numbers in a row: what rows that depend on each other may contradict it by."""


@kernel
def _append(a, Q, R, k):
    """Split a row into the part that active ones span and the rest; return the rest's length.

    Writes the weights as column k of ``R`` and the rest, of unit length, as column k of ``Q``.
    """
    n = len(a)
    for j in range(k):
        R[j, k] = 0.0
    rest = a.copy()
    for _ in range(2):  # twice is enough (Kahan)
        for j in range(k):
            weight = 0.0
            for i in range(n):
                weight += Q[i, j] * rest[i]
            R[j, k] += weight
            for i in range(n):
                rest[i] -= weight * Q[i, j]
    length, size = 0.0, 0.0
    for i in range(n):
        length += rest[i] * rest[i]
        size += a[i] * a[i]
    length, size = np.sqrt(length), np.sqrt(size)
    if length <= _DEPENDENT * size or k >= n:
        return 0.0
    for i in range(n):
        Q[i, k] = rest[i] / length
    R[k, k] = length
    return length


@kernel
def _back_substitute(R, k, column, out):
    """Solve ``R out = R[:, column]`` for the leading k by k triangle."""
    for j in range(k - 1, -1, -1):
        total = R[j, column]
        for i in range(j + 1, k):
            total -= R[j, i] * out[i]
        out[j] = total / R[j, j]


@kernel
def _length(x):
    total = 0.0
    for value in x:
        total += value * value
    return np.sqrt(total)


@kernel
def _most_broken(A, columns, b, lengths, num_equalities, is_held, x, rests, room):
    """Return the row that x breaks by the longest way, -1 for none; fill the rows' residuals."""
    row, worst = -1, 0.0
    exact_residuals(columns, b, len(b), x, rests, room)
    for i in range(len(b)):
        # Equations come first, since they stay.
        rest = -abs(rests[i]) if i < num_equalities else rests[i]
        if not -rest > worst * lengths[i] or is_held[i] or lengths[i] == 0.0:
            continue
        size = abs(b[i])
        for k in range(len(x)):
            size += abs(A[i, k] * x[k])
        if rest < -_INSIDE * size:
            row, worst = i, np.inf if i < num_equalities else -rest / lengths[i]
    return row


@kernel
def _holds_to_rounding(A, b, lengths, is_held, x):
    """Tell whether x fulfils the rows that were taken for fulfilled."""
    size = _length(x)
    for i in range(len(b)):
        if is_held[i]:
            excess = -exact_residual(A[i], x, b[i])
            if not excess <= _ROUNDING * (abs(b[i]) + lengths[i] * size):
                return False
    return True


@kernel
def _settle(A, b, active, k, Q, R, x):
    """Move x the short way onto the active rows."""
    n = len(x)
    for _ in range(2):
        steps = np.zeros(k)
        for j in range(k):
            total = exact_residual(A[active[j]], x, b[active[j]])
            for i in range(j):
                total -= R[i, j] * steps[i]
            steps[j] = total / R[j, j]
        for i in range(n):
            for j in range(k):
                x[i] += Q[i, j] * steps[j]


@kernel
def _first_to_drop(y, steps, lengths, length, active, k, num_equalities):
    """Return the step until the first multiplier of an inequality is 0, and its index."""
    step, drop = np.inf, -1
    for j in range(k):
        i = active[j]
        # Smaller weights in a row of this length are rounding.
        is_weight = steps[j] * lengths[i] > _NO_WEIGHT * length
        if i >= num_equalities and is_weight and y[i] < step * steps[j]:
            step, drop = y[i] / steps[j], j
    return step, drop


@kernel
def _project(A, columns, b, lengths, num_equalities, x, y):
    """Move x ``(n,)`` to the nearest point; fill the multipliers y ``(m,)``; False if it fails."""
    m, n = A.shape
    Q, R, steps = np.zeros((n, n + 1)), np.zeros((n + 1, n + 1)), np.zeros(n + 1)
    active, signs = np.zeros(n + 1, np.int64), np.ones(n + 1)
    is_held, rests, room = np.zeros(m, np.bool_), np.empty(m), np.empty(m)
    y[:] = 0.0
    k, row, sign = 0, -1, 1.0
    for _ in range(10 * (m + n) + 10):
        if row < 0:
            row = _most_broken(A, columns, b, lengths, num_equalities, is_held, x, rests, room)
            if row < 0:
                _settle(A, b, active, k, Q, R, x)
                return _holds_to_rounding(A, b, lengths, is_held, x)
            sign = 1.0 if rests[row] < 0.0 else -1.0
        way = _append(sign * A[row], Q, R, k)
        _back_substitute(R, k, k, steps)
        step, drop = _first_to_drop(y, steps, lengths, lengths[row], active, k, num_equalities)
        excess = -sign * exact_residual(A[row], x, b[row])
        full = max(excess, 0.0) / (way * way) if way > 0.0 else np.inf
        if full == np.inf and step == np.inf:
            # No point of the active rows fulfils it, but some point of the set does: what it
            # is broken by is rounding, or that of these rows.
            if not excess <= _ROUNDING * (abs(b[row]) + lengths[row] * _length(x)):
                return False
            is_held[row] = True
            row = -1
            continue
        whole = full <= step
        length = full if whole else step
        for j in range(k):
            y[active[j]] -= length * steps[j] * signs[j]
        y[row] += length * sign
        if way > 0.0:
            for i in range(n):
                x[i] -= length * way * Q[i, k]
        if whole:
            active[k], signs[k], is_held[row] = row, sign, True
            k += 1
            row = -1
        else:
            y[active[drop]], is_held[active[drop]] = 0.0, False
            for j in range(drop, k - 1):
                active[j], signs[j] = active[j + 1], signs[j + 1]
            k -= 1
            for j in range(drop, k):
                _append(signs[j] * A[active[j]], Q, R, j)
    return False


@kernel
def _project_all(A, b, lengths, num_equalities, points, y):
    columns = np.ascontiguousarray(A.T)
    for i in range(len(points)):
        if not _project(A, columns, b, lengths, num_equalities, points[i], y[i]):
            return i
    return -1


def project_points(
    A: np.ndarray, b: np.ndarray, num_equalities: int, points: np.ndarray
) -> tuple[np.ndarray, np.ndarray, int]:
    """Return the nearest points ``(p, n)`` of a polyhedron that isn't empty, and multipliers.

    ``points (p, n)``; multipliers ``(p, m)`` of the rows ``A (m, n)``, those first that are
    equations: the vector from a nearest point to the point is their weighted sum. The last number
    is the first point for which the method failed, -1 for none.
    """
    nearest, y = points.copy(), np.zeros((len(points), len(b)))
    failed = _project_all(A, b, np.linalg.norm(A, axis=1), num_equalities, nearest, y)
    return nearest, y, failed
