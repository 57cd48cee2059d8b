"""The largest ellipsoid within rows: a primal-dual interior point method.

Zhang and Gao, "On numerical solution of the maximum volume ellipsoid problem", SIAM Journal on
Optimization 14, 2003, section 4: the ellipsoid's square ``(A' Y A)^-1`` is eliminated, and what is
left are the centre, one multiplier and one slack for each row.
"""

from __future__ import annotations

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import kernel
from scene_graph_ros.geometry.optimization.solve.dense import (
    factor,
    solve_factored,
    solve_general,
)

__all__ = ["largest_inscribed"]

_MOST_STEPS = 100
"""Newton steps; some fifteen are taken."""

_RESIDUAL = 1e-13
"""Of rows whose right sides are 1: where the method ends, or when it gets no better."""

_LEAST_TARGET = 2e-14
"""Of a product of multiplier and slack: smaller ones would let slacks vanish beside rounding."""

_NEAR = 1e-8
"""Of a product of multiplier and slack: so near the end, residuals that grow are rounding."""

_TO_BORDER = 0.9
"""Of the way to the border, the share that a step may take while residuals are large."""


@kernel
def _squares(A, y, W, lengths):
    """Fill ``W (m, n)`` with rows of which the products are those of ``A (A' Y A)^-1 A'``.

    And ``lengths (m,)`` with theirs. Return False where the matrix in between is singular.
    """
    m, n = A.shape
    M = np.zeros((n, n))
    for i in range(m):
        for a in range(n):
            weighed = y[i] * A[i, a]
            for b in range(a, n):
                M[a, b] += weighed * A[i, b]
    if not factor(M):
        return False
    for i in range(m):
        total = 0.0
        for a in range(n):
            value = A[i, a]
            for b in range(a):
                value -= M[b, a] * W[i, b]
            W[i, a] = value / M[a, a]
            total += W[i, a] * W[i, a]
        lengths[i] = np.sqrt(total)
    return True


@kernel
def _matrix(W, y, z, h):
    """Return what ties the rates of the multipliers to each other, as its upper triangle."""
    m, n = W.shape
    G = np.empty((m, m))
    for i in range(m):
        for j in range(i, m):
            product = 0.0
            for a in range(n):
                product += W[i, a] * W[j, a]
            G[i, j] = y[i] * product * (y[j] * product)
        G[i, i] += 2.0 * y[i] * h[i] * z[i]
    return G


@kernel
def _direction(A, W, y, z, h, r1, r2, r3, dx, rate):
    """Fill ``dx (n,)`` and ``rate (m,)``, of the multipliers, with a Newton step; False for none.

    What a step does to the rows is solved once, for the centre's part and for the rest.
    """
    m, n = A.shape
    G = _matrix(W, y, z, h)
    if not factor(G):
        return False
    T = np.empty((m, n))
    for i in range(m):
        for a in range(n):
            T[i, a] = (h[i] + z[i]) * y[i] * A[i, a]
    solve_factored(G, T)
    M = np.zeros((n, n))
    for a in range(n):
        dx[a] = r1[a]
    for i in range(m):
        r23 = r2[i] - r3[i] / y[i]
        for a in range(n):
            p = 2.0 * y[i] * h[i] * T[i, a] - y[i] * A[i, a]
            dx[a] += p * r23
            for b in range(n):
                M[a, b] += p * A[i, b]
    if not solve_general(M, dx):
        return False
    column = np.empty((m, 1))
    for i in range(m):
        Adx = 0.0
        for a in range(n):
            Adx += A[i, a] * dx[a]
        column[i, 0] = 2.0 * y[i] * h[i] * (Adx - (r2[i] - r3[i] / y[i]))
    solve_factored(G, column)
    for i in range(m):
        rate[i] = column[i, 0]
    return True


@kernel
def _step(A, x, y, z, slack, r3, dx, rate, residual):
    """Move the centre, multipliers and slacks along a direction, as far as they stay positive."""
    m, n = A.shape
    nearest = 0.5
    for i in range(m):
        Adx = 0.0
        for a in range(n):
            Adx += A[i, a] * dx[a]
        dz = r3[i] / y[i] - z[i] * rate[i]
        nearest = max(nearest, Adx / slack[i], -rate[i], -dz / z[i])
    step = max(_TO_BORDER, 1.0 - residual) * min(1.0, 1.0 / nearest)
    for a in range(n):
        x[a] += step * dx[a]
    for i in range(m):
        Adx = 0.0
        for a in range(n):
            Adx += A[i, a] * dx[a]
        dz = r3[i] / y[i] - z[i] * rate[i]
        y[i] += step * y[i] * rate[i]
        z[i] += step * dz
        slack[i] -= step * Adx


@kernel
def _newton(A, x, y, z):
    """Move x ``(n,)``, y and z ``(m,)`` from where they start to the best point of the method."""
    m, n = A.shape
    W, h, slack = np.empty((m, n)), np.empty(m), np.ones(m)
    r1, r2, r3 = np.empty(n), np.empty(m), np.empty(m)
    dx, rate = np.empty(n), np.empty(m)
    best, best_x, best_y = np.inf, x.copy(), y.copy()
    for _ in range(_MOST_STEPS):
        if not _squares(A, y, W, h):
            break
        gap = 0.0
        for i in range(m):
            gap += y[i] * z[i]
        gap /= m
        target = max(_LEAST_TARGET, min(0.5, gap) * gap)
        r1[:] = 0.0
        residual = 0.0
        for i in range(m):
            r2[i] = slack[i] - h[i] - z[i]
            r3[i] = target - y[i] * z[i]
            residual = max(residual, abs(r2[i]), abs(r3[i]))
            for a in range(n):
                r1[a] -= A[i, a] * y[i] * h[i]
        # Multipliers that don't balance cost the bound the square of what is left.
        for a in range(n):
            residual = max(residual, r1[a] * r1[a])
        if max(residual, gap) < best:
            best = max(residual, gap)
            best_x[:] = x
            best_y[:] = y
        has_passed = gap <= _NEAR and residual > 10.0 * best
        if max(residual, gap) <= _RESIDUAL or has_passed or not np.isfinite(residual):
            break
        if not _direction(A, W, y, z, h, r1, r2, r3, dx, rate):
            break
        _step(A, x, y, z, slack, r3, dx, rate, residual)
    x[:] = best_x
    y[:] = best_y


def largest_inscribed(A: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return centre ``(n,)``, symmetric map ``(n, n)`` and multipliers of the largest ellipsoid.

    In ``A x <= 1``, which is bounded, of m rows; multipliers ``(m,)`` weigh ``|E a|``. Raises
    LinAlgError where the rows don't bound all directions, to rounding.
    """
    A = np.ascontiguousarray(A, dtype=np.float64)
    m, n = A.shape
    square = np.linalg.inv(A.T @ A)
    lengths = np.sqrt(np.einsum("ij,jk,ik->i", A, square, A))
    shrink = float((1.0 / lengths).min())
    x, y = np.zeros(n), np.full(m, shrink**-2)
    z = np.maximum(0.1, 1.0 - shrink * lengths)
    _newton(A, x, y, z)
    values, axes = np.linalg.eigh(A.T @ (y[:, None] * A))
    if not values[0] > 0.0:
        raise np.linalg.LinAlgError("its square is singular, to rounding")
    E = axes @ np.diag(1.0 / np.sqrt(values)) @ axes.T
    return x, E, y * np.linalg.norm(A @ E, axis=1)
