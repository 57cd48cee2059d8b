"""The largest ellipsoid within rows: a primal-dual interior point method.

Zhang and Gao, "On numerical solution of the maximum volume ellipsoid problem", SIAM Journal on
Optimization 14, 2003, section 4: the ellipsoid's square ``(A' Y A)^-1`` is eliminated, and what is
left are the centre, one multiplier and one slack for each row.
"""

from __future__ import annotations

import numpy as np

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


def largest_inscribed(A: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return centre ``(n,)``, symmetric map ``(n, n)`` and multipliers of the largest ellipsoid.

    In ``A x <= 1``, which is bounded, of m rows; multipliers ``(m,)`` weigh ``|E a|``.
    """
    m, n = A.shape
    x, y, slack = np.zeros(n), np.ones(m), np.ones(m)
    square = np.linalg.inv(A.T @ A)
    lengths = np.sqrt(np.einsum("ij,jk,ik->i", A, square, A))
    shrink = float((slack / lengths).min())
    y /= shrink**2
    z = np.maximum(0.1, slack - shrink * lengths)
    best = (np.inf, x, square * shrink**2, y)
    for _ in range(_MOST_STEPS):
        square = np.linalg.inv(A.T @ (y[:, None] * A))
        Q = A @ square @ A.T
        h = np.sqrt(np.diagonal(Q))
        gap = float(y @ z) / m
        target = max(_LEAST_TARGET, min(0.5, gap) * gap)
        r1, r2, r3 = -A.T @ (y * h), slack - h - z, target - y * z
        # Multipliers that don't balance cost the bound the square of what is left.
        residual = max(np.abs(r1).max() ** 2, np.abs(r2).max(), np.abs(r3).max())
        if max(residual, gap) < best[0]:
            best = (max(residual, gap), x, square, y)
        has_passed = gap <= _NEAR and residual > 10.0 * best[0]
        if max(residual, gap) <= _RESIDUAL or has_passed or not np.isfinite(residual):
            break
        YQ = y[:, None] * Q
        G = YQ * YQ.T + np.diag(2.0 * y * h * z)
        T = np.linalg.solve(G, ((h + z) * y)[:, None] * A)
        P = ((2.0 * y * h)[:, None] * T - y[:, None] * A).T
        r23 = r2 - r3 / y
        dx = np.linalg.solve(P @ A, r1 + P @ r23)
        Adx = A @ dx
        rate = np.linalg.solve(G, 2.0 * y * h * (Adx - r23))
        dz = r3 / y - z * rate
        nearest = max(0.5, float((Adx / slack).max()), float(-rate.min()), float((-dz / z).max()))
        step = max(_TO_BORDER, 1.0 - residual) * min(1.0, 1.0 / nearest)
        x, y, z, slack = x + step * dx, y + step * y * rate, z + step * dz, slack - step * Adx
    _, x, square, y = best
    values, axes = np.linalg.eigh(0.5 * (square + square.T))
    E = axes @ np.diag(np.sqrt(np.maximum(values, 0.0))) @ axes.T
    return x, E, y * np.linalg.norm(A @ E, axis=1)
