"""Products, lengths and small systems in one order of sums.

A library of linear algebra has an order for each processor, and the last bits of its results
depend on that. Sums of queries, shapes and robots go through these instead.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.kernel import kernel, lean_kernel
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = ["determinant", "least_squares", "length", "moved", "product"]

FloatArray = NDArray[np.float64]

_VECTORS = {(1, 1): "i,i->", (2, 1): "ij,j->i", (1, 2): "i,ij->j"}
_SWEEPS = 30
"""Of Jacobi's method, which converges quadratically: six or so are enough."""


def product(A: FloatArray, B: FloatArray) -> Any:
    """Return ``A @ B`` of vectors, matrices or stacks of matrices."""
    return np.einsum(_VECTORS.get((A.ndim, B.ndim), "...ij,...jk->...ik"), A, B)


def length(v: FloatArray) -> float:
    """Return the Euclidean length of a vector ``(n,)``."""
    return math.sqrt(np.einsum("i,i->", v, v))


def moved(points: FloatArray, X_AB: FloatArray) -> FloatArray:
    """Return points ``(n, 3)`` of B in A, where B has the pose ``X_AB`` ``(4, 4)``."""
    result: FloatArray = np.einsum("nj,ij->ni", points, X_AB[:3, :3]) + X_AB[:3, 3]
    return result


def determinant(R: FloatArray) -> float:
    """Return the determinant of a matrix ``(3, 3)``."""
    return float(product(R[0], np.cross(R[1], R[2])))


def least_squares(rows: FloatArray, sides: FloatArray, rcond: float) -> FloatArray:
    """Return the shortest x ``(n,)`` with the least squares of ``rows @ x - sides``.

    Directions whose singular value is below ``rcond`` times the largest are left out.
    """
    x = np.zeros(rows.shape[1])
    _solve_least_squares(np.array(rows, order="C"), np.ascontiguousarray(sides), rcond, x)
    return x


@lean_kernel
def _turn_columns(M, p, q, c, s):
    """Turn two columns of M in their plane."""
    for i in range(len(M)):
        M[i, p], M[i, q] = c * M[i, p] - s * M[i, q], s * M[i, p] + c * M[i, q]


@lean_kernel
def _make_orthogonal(U, V, p, q):
    """Turn two columns of U, and of V, so that those of U are orthogonal; tell if they were."""
    a = b = d = 0.0
    for i in range(len(U)):
        a += U[i, p] * U[i, p]
        b += U[i, q] * U[i, q]
        d += U[i, p] * U[i, q]
    if abs(d) <= EPSILON * math.sqrt(a) * math.sqrt(b):
        return True
    tau = (b - a) / (2.0 * d)
    t = math.copysign(1.0 / (abs(tau) + math.sqrt(1.0 + tau * tau)), tau)
    c = 1.0 / math.sqrt(1.0 + t * t)
    _turn_columns(U, p, q, c, t * c)
    _turn_columns(V, p, q, c, t * c)
    return False


@kernel
def _solve_least_squares(U, sides, rcond, x):
    """Add the solution to x; U ``(m, n)`` is overwritten.

    Pairs of columns are turned until all are orthogonal: one-sided Jacobi (Hestenes 1958; Golub
    and Van Loan, *Matrix Computations*, 8.6.3). Their lengths are then the singular values.
    """
    m, n = U.shape
    V = np.eye(n)
    for _ in range(_SWEEPS):
        is_done = True
        for p in range(n - 1):
            for q in range(p + 1, n):
                is_done &= _make_orthogonal(U, V, p, q)
        if is_done:
            break
    squares, along = np.zeros(n), np.zeros(n)
    for k in range(n):
        for i in range(m):
            squares[k] += U[i, k] * U[i, k]
            along[k] += U[i, k] * sides[i]
    least = rcond * math.sqrt(squares.max())
    for k in range(n):
        if math.sqrt(squares[k]) > least:
            for i in range(n):
                x[i] += V[i, k] * (along[k] / squares[k])
