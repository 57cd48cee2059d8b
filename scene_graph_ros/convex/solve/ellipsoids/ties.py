"""The relations of the multipliers of rows, where an ellipsoid is inscribed in them.

Of the method in `inscribed`: a matrix of all pairs of rows, which for many rows is of low rank but
for its diagonal, and then solved by way of that (Woodbury, "Inverting modified matrices", 1950).
"""

from __future__ import annotations

import numpy as np

from scene_graph_ros.convex.solve.linear_algebra.dense import solve_factored
from scene_graph_ros.geometry.compiled.kernel import kernel

__all__ = ["solve_ties", "ties_of"]

_ROOT_2 = 2.0**0.5


@kernel
def _matrix(W, y, z, h):
    """Return the matrix of all rows, as its upper triangle."""
    m, n = W.shape
    G, columns = np.zeros((m, m)), np.ascontiguousarray(W.T)
    for i in range(m):
        products = G[i]
        for a in range(n):
            column, weight = columns[a], W[i, a]
            for j in range(m):
                products[j] += weight * column[j]
        for j in range(m):
            products[j] = y[i] * products[j] * (y[j] * products[j])
        G[i, i] += 2.0 * y[i] * h[i] * z[i]
    return G


@kernel
def _by_products(W, y, z, h):
    """Return d and V of the same matrix ``diag(d) + V V'``, and ``I + V' diag(1 / d) V``.

    Squares of ``w_i . w_j`` are products of all products of their entries, which are far fewer
    than many rows.
    """
    m, n = W.shape
    k = n * (n + 1) // 2
    d, V, S = np.empty(m), np.empty((m, k)), np.eye(k)
    for i in range(m):
        d[i] = 2.0 * y[i] * h[i] * z[i]
        at = 0
        for a in range(n):
            along = y[i] * W[i, a]
            V[i, at] = along * W[i, a]
            at += 1
            for b in range(a + 1, n):
                V[i, at] = _ROOT_2 * along * W[i, b]
                at += 1
        inverse = 1.0 / d[i]
        for a in range(k):
            weight = inverse * V[i, a]
            for b in range(a, k):
                S[a, b] += weight * V[i, b]
    return d, V, S


@kernel
def ties_of(W, y, z, h, is_split):
    """Return d, V and a matrix to be factored; V is empty where it is not split.

    Rows of ``W (m, n)`` are those of which the products are in it, ``h (m,)`` their lengths.
    """
    if is_split:
        return _by_products(W, y, z, h)
    return np.empty(0), np.empty((0, 0)), _matrix(W, y, z, h)


@kernel
def solve_ties(d, V, S, X):
    """Replace X ``(m, c)`` by the solution, once S of `ties_of` is factored."""
    m, k = V.shape
    if not k:
        solve_factored(S, X)
        return
    inner = np.zeros((k, X.shape[1]))
    for i in range(m):
        for c in range(X.shape[1]):
            X[i, c] /= d[i]
            for a in range(k):
                inner[a, c] += V[i, a] * X[i, c]
    solve_factored(S, inner)
    for i in range(m):
        for c in range(X.shape[1]):
            total = 0.0
            for a in range(k):
                total += V[i, a] * inner[a, c]
            X[i, c] -= total / d[i]
