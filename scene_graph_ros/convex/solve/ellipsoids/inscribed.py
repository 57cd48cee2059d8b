"""The largest ellipsoid within rows: a primal-dual interior point method.

Zhang and Gao, "On numerical solution of the maximum volume ellipsoid problem", SIAM Journal on
Optimization 14, 2003, section 4: the ellipsoid's square ``(A' Y A)^-1`` is eliminated; there
remain the centre, one multiplier and one slack for each row.
"""

from __future__ import annotations

import numpy as np

from scene_graph_ros.convex.solve.ellipsoids.ties import solve_ties, ties_of
from scene_graph_ros.convex.solve.linear_algebra.dense import factor, solve_general
from scene_graph_ros.geometry.compiled.kernel import kernel

__all__ = ["largest_inscribed", "largest_within"]

_MOST_STEPS = 100
"""Newton steps; some fifteen are taken."""

_RESIDUAL = 1e-13
"""Of rows whose right sides are 1: where the method ends, or when it gets no better."""

_SHARE = 1.0 / 32.0
"""Of a log volume that is known well enough, what all rows' residuals together may be, and what
shrinking the ellipsoid may cost along all axes."""

_LEAST_TARGET = 2e-14
"""Of a product of multiplier and slack: smaller ones would let slacks vanish beside rounding."""

_NEAR = 1e-8
"""Of a product of multiplier and slack: so near the end, residuals that grow are rounding."""

_FAR_AWAY = 0.1
"""Of its slack, the multiplier of a row that no longer counts: the ellipsoid won't touch it."""

_SPLIT_UNTIL = 1e-8
"""Of a product of multiplier and slack: until there the matrix of many rows is split. Where they
are smaller, differences would leave too little."""

_IS_KNOWN_FROM = 1e-2
"""Of a product of multiplier and slack: from there on these tell which rows count."""

_BEYOND = 1e-13
"""Relative to its slack: an ellipsoid that is beyond a row by more was not to leave it out."""

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
def _direction(A, W, y, z, h, r1, r2, r3, dx, rate, is_split):
    """Fill ``dx (n,)`` and ``rate (m,)``, of the multipliers, with a Newton step; False for none.

    A step's change of the rows is solved once, for the centre's part and for the rest.
    """
    m, n = A.shape
    W = W[:m]
    d, V, G = ties_of(W, y, z, h, is_split)
    if not factor(G):
        return False
    T = np.empty((m, n))
    for i in range(m):
        for a in range(n):
            T[i, a] = (h[i] + z[i]) * y[i] * A[i, a]
    solve_ties(d, V, G, T)
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
    solve_ties(d, V, G, column)
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
def _drop_far(A, y, z, slack, names, count):
    """Move rows that no longer count behind the others; return how many do."""
    left = 0
    for i in range(count):
        if y[i] >= _FAR_AWAY * z[i]:
            if left < i:
                A[left] = A[i]
                y[left], z[left], slack[left], names[left] = y[i], z[i], slack[i], names[i]
            left += 1
    return left


@kernel
def _newton(A, x, y, z, drops, enough):
    """Move x ``(n,)``, y and z ``(m,)`` from where they start to the best point of the method.

    Residuals of ``enough`` will do. With ``drops`` rows that the ellipsoid won't touch are left
    out once that is seen, with a multiplier of 0.
    """
    m, n = A.shape
    A, slack, names, count = A.copy(), np.ones(m), np.arange(m), m
    W, h = np.empty((m, n)), np.empty(m)
    r1, r2, r3 = np.empty(n), np.empty(m), np.empty(m)
    dx, rate = np.empty(n), np.empty(m)
    best, best_x, best_y = np.inf, x.copy(), y.copy()
    for _ in range(_MOST_STEPS):
        if not _squares(A[:count], y, W, h):
            break
        gap = 0.0
        for i in range(count):
            gap += y[i] * z[i]
        gap /= count
        target = max(_LEAST_TARGET, min(0.5, gap) * gap)
        r1[:] = 0.0
        residual = 0.0
        for i in range(count):
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
            best_y[:] = 0.0
            for i in range(count):
                best_y[names[i]] = y[i]
        has_passed = gap <= _NEAR and residual > 10.0 * best
        if max(residual, gap) <= max(_RESIDUAL, enough) or has_passed or not np.isfinite(residual):
            break
        is_split = gap > _SPLIT_UNTIL and count > n * (n + 1) // 2
        if not _direction(A[:count], W, y, z, h, r1, r2, r3, dx, rate, is_split):
            break
        _step(A[:count], x, y, z, slack, r3, dx, rate, residual)
        if drops and gap <= _IS_KNOWN_FROM:
            there = count
            count = _drop_far(A, y, z, slack, names, there)
            # What was left out no longer balances the others, until the next step.
            best = best if count == there else np.inf
    x[:] = best_x
    y[:] = best_y


@kernel
def _inverse_of_factor(U, E):
    """Fill E ``(n, n)`` with ``U^-1``, of an upper triangle."""
    n = len(U)
    E[:] = 0.0
    for c in range(n):
        for k in range(c, -1, -1):
            total = 1.0 if k == c else 0.0
            for j in range(k + 1, c + 1):
                total -= U[k, j] * E[j, c]
            E[k, c] = total / U[k, k]


@kernel
def _attempt(A, x, E, weights, drops, enough):
    """Fill the answer of `largest_within`; -1 where it fails, 0 where it is not inside."""
    m, n = A.shape
    W, h, y = np.empty((m, n)), np.empty(m), np.ones(m)
    if not _squares(A, y, W, h):
        return -1
    shrink = 1.0 / h.max()
    y[:] = shrink**-2
    z = np.maximum(0.1, 1.0 - shrink * h)
    x[:] = 0.0
    _newton(A, x, y, z, drops, _SHARE * enough / max(m, 1))
    beyond = max(_BEYOND, _SHARE * enough / max(n, 1))
    M = np.zeros((n, n))
    for i in range(m):
        for a in range(n):
            weighed = y[i] * A[i, a]
            for b in range(a, n):
                M[a, b] += weighed * A[i, b]
    if not factor(M):
        return -1
    _inverse_of_factor(M, E)
    is_inside = 1
    for i in range(m):
        square, slack = 0.0, 1.0
        for a in range(n):
            total = 0.0
            for b in range(a + 1):
                total += A[i, b] * E[b, a]
            square += total * total
            slack -= A[i, a] * x[a]
        weights[i] = y[i] * np.sqrt(square)
        if y[i] == 0.0 and slack < (1.0 - beyond) * np.sqrt(square):
            is_inside = 0
    return is_inside


@kernel
def largest_within(A, x, E, weights, enough):
    """Fill centre ``(n,)``, map ``(n, n)`` and multipliers ``(m,)`` of the largest ellipsoid.

    In ``A x <= 1``, which is bounded, of m rows; multipliers weigh ``|E' a|``. A log volume known
    to ``enough`` will do. False where the rows don't bound all directions, to rounding.
    """
    found = _attempt(A, x, E, weights, True, enough)
    if found == 0:
        # A row that was left out would have counted.
        found = _attempt(A, x, E, weights, False, enough)
    return found >= 0


def largest_inscribed(A: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the answer of `largest_within`. Raises LinAlgError where it doesn't."""
    A = np.array(A, dtype=np.float64, order="C")  # one that may be written, as `inscribe` has it
    m, n = A.shape
    x, E, weights = np.empty(n), np.empty((n, n)), np.empty(m)
    if not largest_within(A, x, E, weights, 0.0):
        raise np.linalg.LinAlgError("its square is singular, to rounding")
    return x, E, weights
