"""Symmetric systems with a band along the diagonal, definite in parts: factors and solutions.

A matrix is its lower band ``M (n, w + 1)``: ``M[i, j]`` is the entry of row i and column i - j.
Rows of variables are positive definite and rows of equations negative, so that elimination needs
no pivots in any order (Vanderbei, "Symmetric quasi-definite matrices", 1995).
"""

from __future__ import annotations

from scene_graph_ros.geometry.compiled.kernel import lean_kernel

__all__ = ["factor_band", "solve_band"]

_REGULAR = 1e-13
"""What is added to the diagonal, of a matrix whose entries are about 1 or larger."""

_LOST = 1e-15
"""Relative to the diagonal: the least pivot. Of a smaller one rounding has left nothing, and what
it is matters little, as long as what is beside it is passed on."""


@lean_kernel
def factor_band(M, signs, L):
    """Set ``L (n, w + 1)`` to the band of L with ``L D L' = M``, and D where L has ones.

    ``signs (n,)`` are the signs of pivots, 1 or -1.
    """
    n, width = M.shape
    for i in range(n):
        low = max(0, i - width + 1)
        for j in range(low, i):
            total = M[i, i - j]
            for k in range(max(low, j - width + 1), j):
                total -= L[i, i - k] * L[j, j - k]
            # Times D of column j, until the row is done.
            L[i, i - j] = total
        pivot = M[i, 0] + signs[i] * _REGULAR
        for j in range(low, i):
            scaled = L[i, i - j] / L[j, 0]
            pivot -= scaled * L[i, i - j]
            L[i, i - j] = scaled
        L[i, 0] = signs[i] * max(pivot * signs[i], _LOST * abs(M[i, 0]), _REGULAR)


@lean_kernel
def solve_band(L, x):
    """Replace x ``(n,)`` by the solution of ``L D L' x = x``; entries behind n are left alone."""
    n, width = L.shape
    for i in range(n):
        total = x[i]
        for j in range(max(0, i - width + 1), i):
            total -= L[i, i - j] * x[j]
        x[i] = total
    for i in range(n):
        x[i] /= L[i, 0]
    for i in range(n - 1, -1, -1):
        value = x[i]
        for j in range(max(0, i - width + 1), i):
            x[j] -= L[i, i - j] * value
