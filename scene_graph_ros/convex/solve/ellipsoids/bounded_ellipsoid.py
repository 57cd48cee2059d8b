"""The largest ellipsoid within rows: inside without tolerance, with a bound of all others."""

from __future__ import annotations

import numpy as np

from scene_graph_ros.convex.solve.ellipsoids.inscribed import largest_within
from scene_graph_ros.convex.solve.linear_algebra.dense import factor, solve_factored
from scene_graph_ros.convex.solve.linear_algebra.doubled import exact_residual
from scene_graph_ros.geometry.compiled.kernel import kernel
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = ["INSCRIBED", "OUTSIDE", "SINGULAR", "inscribe"]

INSCRIBED, OUTSIDE, SINGULAR = 0, 1, 2
"""An ellipsoid was found, the place to begin is outside, or rows don't bound all directions."""


@kernel
def _balance(rows, y):
    """Change weights by the least, relative to them, so that weighted rows add up to zero.

    False where the rows don't span all directions.
    """
    m, n = rows.shape
    for _ in range(2):
        M, tilt = np.zeros((n, n)), np.zeros((n, 1))
        for i in range(m):
            for a in range(n):
                weighed = y[i] * rows[i, a]
                tilt[a, 0] += weighed
                for b in range(a, n):
                    M[a, b] += weighed * rows[i, b]
        if not factor(M):
            return False
        solve_factored(M, tilt)
        for i in range(m):
            part = 1.0
            for a in range(n):
                part -= rows[i, a] * tilt[a, 0]
            y[i] *= max(part, 0.0)
    return True


@kernel
def _bound(rows, y, reach, slacks):
    """Return an upper bound of the log volume of maps after B, infinite where that fails.

    Multipliers y with ``sum y a = 0`` give ``sum y |B' a| <= sum y slack``. With unit vectors
    v along ``B' a`` and ``M = sum y (B' a) v'``, a map F after B has ``trace(F M)`` at most that,
    and ``det(F)^(1/n) <= trace(F M) / (n det(M)^(1/n))``.
    """
    m, n = rows.shape
    if not _balance(rows, y):
        return np.inf
    M, left, total = np.zeros((n, n)), np.zeros(n), 0.0
    for i in range(m):
        total += y[i] * abs(slacks[i])
        for a in range(n):
            left[a] += y[i] * rows[i, a]
            for b in range(a, n):
                M[a, b] += y[i] / reach[i] * rows[i, a] * rows[i, b]
    if not factor(M):
        return np.inf
    # What is left of sum y a moves the bound by no more than this over the set, which is within n
    # times the ellipsoid (John 1948), here taken twice.
    total += 2.0 * n * np.sqrt((left * left).sum())
    if not total > 0.0:
        return np.inf
    upper = n * np.log(total / n)
    for a in range(n):
        upper -= 2.0 * np.log(M[a, a])
    return upper


@kernel
def _put_inside(A, b, center, B, rows, y):
    """Return the factor that shrinks an ellipsoid to be inside, and its error.

    ``rows (m, n)`` are ``A B`` and y multipliers of them.
    """
    m, n = A.shape
    slacks, reach, shrink = np.empty(m), np.empty(m), np.inf
    for i in range(m):
        slacks[i] = exact_residual(A[i], center, b[i])
        square, cancelled = 0.0, 0.0
        for c in range(n):
            total, size = 0.0, 0.0
            for k in range(n):
                product = A[i, k] * B[k, c]
                total += product
                size += abs(product)
            rows[i, c] = total
            square += total * total
            cancelled += size * size
        reach[i] = np.sqrt(square)
        # Where columns are long beside the reach, their products cancel.
        far = reach[i] + 0.501 * n * EPSILON * np.sqrt(cancelled)
        shrink = min(shrink, slacks[i] / far)
    shrink *= 1.0 - 16.0 * (n + 1) * EPSILON
    if not shrink > 0.0:
        return shrink, np.inf
    return shrink, max(_bound(rows, y, reach, slacks) - n * np.log(shrink), 0.0)


@kernel
def inscribe(A, b, center, B, enough):
    """Move a centre ``(n,)`` and map ``(n, n)`` to those of the largest ellipsoid in ``A x <= b``.

    They are where to begin: the centre inside, the map to coordinates in which the set is about
    round. A log volume known to ``enough`` will do. Returns INSCRIBED, by how much the ellipsoid
    is to be shrunk to be inside without tolerance, and how much larger the log volume of another
    may be than that; or OUTSIDE where the centre is not inside, SINGULAR where the rows don't
    bound all directions, to rounding.
    """
    m, n = A.shape
    rows, scaled, slacks = np.empty((m, n)), np.empty((m, n)), np.empty(m)
    for i in range(m):
        slacks[i] = b[i]
        for k in range(n):
            slacks[i] -= A[i, k] * center[k]
        if not slacks[i] > 0.0:
            return OUTSIDE, 0.0, np.inf
        for c in range(n):
            total = 0.0
            for k in range(n):
                total += A[i, k] * B[k, c]
            scaled[i, c] = total / slacks[i]
    x, E, y = np.empty(n), np.empty((n, n)), np.empty(m)
    if not largest_within(scaled, x, E, y, enough):
        return SINGULAR, 0.0, np.inf
    old = B.copy()
    for k in range(n):
        for c in range(n):
            center[k] += old[k, c] * x[c]
            total = 0.0
            for a in range(c + 1):
                total += old[k, a] * E[a, c]
            B[k, c] = total
    for i in range(m):
        y[i] /= slacks[i]
    shrink, gap = _put_inside(A, b, center, B, rows, y)
    return INSCRIBED, shrink, gap
