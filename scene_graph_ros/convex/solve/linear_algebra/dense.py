"""Small systems of linear equations inside kernels: by Cholesky's factors, or by elimination."""

from __future__ import annotations

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import kernel

__all__ = ["factor", "solve_factored", "solve_general", "solve_lower"]


@kernel
def factor(G):
    """Replace the upper triangle of G ``(m, m)`` by U with ``U' U = G``.

    Return False where G is not positive definite, to rounding. The rest of G is not read.
    """
    m = len(G)
    for k in range(m):
        if not G[k, k] > 0.0:
            return False
        root = np.sqrt(G[k, k])
        for j in range(k, m):
            G[k, j] /= root
        for i in range(k + 1, m):
            share = G[k, i]
            for j in range(i, m):
                G[i, j] -= share * G[k, j]
    return True


@kernel
def solve_lower(U, T):
    """Replace T ``(m, r)`` by ``U'^-1 T``."""
    m, r = T.shape
    for k in range(m):
        for c in range(r):
            T[k, c] /= U[k, k]
        for i in range(k + 1, m):
            for c in range(r):
                T[i, c] -= U[k, i] * T[k, c]


@kernel
def solve_factored(U, T):
    """Replace T ``(m, r)`` by ``(U' U)^-1 T``."""
    solve_lower(U, T)
    m, r = T.shape
    for k in range(m - 1, -1, -1):
        for i in range(k + 1, m):
            for c in range(r):
                T[k, c] -= U[k, i] * T[i, c]
        for c in range(r):
            T[k, c] /= U[k, k]


@kernel
def solve_general(M, x):
    """Replace x ``(n,)`` by ``M^-1 x`` and M by its factors.

    With partial pivoting. Return False where M is singular.
    """
    n = len(x)
    for k in range(n):
        pivot = k
        for i in range(k + 1, n):
            if abs(M[i, k]) > abs(M[pivot, k]):
                pivot = i
        if not abs(M[pivot, k]) > 0.0:
            return False
        if pivot != k:
            for j in range(k, n):
                M[k, j], M[pivot, j] = M[pivot, j], M[k, j]
            x[k], x[pivot] = x[pivot], x[k]
        for i in range(k + 1, n):
            share = M[i, k] / M[k, k]
            for j in range(k + 1, n):
                M[i, j] -= share * M[k, j]
            x[i] -= share * x[k]
    for k in range(n - 1, -1, -1):
        for j in range(k + 1, n):
            x[k] -= M[k, j] * x[j]
        x[k] /= M[k, k]
    return True
