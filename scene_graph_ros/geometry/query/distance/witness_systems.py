"""Four linear equations for each pair, solved with the same bits on every processor."""

import math

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import kernel, lean_kernel
from scene_graph_ros.geometry.tolerances import SINGULAR_CONTACT

__all__ = ["solve_witnesses"]

_ROWS = 4


@lean_kernel
def _scale_columns(M, lengths):
    """Make the columns of M unit vectors; tell whether that can be done."""
    for j in range(_ROWS):
        square = 0.0
        for i in range(_ROWS):
            square += M[i, j] * M[i, j]
        lengths[j] = math.sqrt(square)
        if not 0.0 < lengths[j] < math.inf:
            return False
        for i in range(_ROWS):
            M[i, j] /= lengths[j]
    return True


@lean_kernel
def _eliminate(M):
    """Replace the columns behind the first four by those times their inverse (Gauss-Jordan).

    Rows are exchanged so that each pivot is the largest of its column. Returns False where one
    is zero.
    """
    width = M.shape[1]
    for j in range(_ROWS):
        best = j
        for i in range(j + 1, _ROWS):
            if abs(M[i, j]) > abs(M[best, j]):
                best = i
        pivot = M[best, j]
        if pivot == 0.0:
            return False
        for k in range(j, width):
            passed = M[j, k]
            M[j, k] = M[best, k] / pivot
            if best != j:
                M[best, k] = passed
        for i in range(_ROWS):
            factor = M[i, j]
            if i != j and factor != 0.0:
                for k in range(j, width):
                    M[i, k] -= factor * M[j, k]
    return True


@kernel
def solve_witnesses(matrix, right, is_solvable):
    """Replace ``right (k, 4, n)`` by ``matrix^-1 right``, where that is solvable; else by zeros.

    Systems that count as singular are marked in ``is_solvable (k,)``: of the matrix with unit
    columns, the inverse is so long (Frobenius) that the smallest singular value, which is at most
    twice the length's inverse, is SINGULAR_CONTACT or less.
    """
    n = right.shape[2]
    M, lengths = np.empty((_ROWS, 2 * _ROWS + n)), np.empty(_ROWS)
    for pair in range(len(matrix)):
        M[:, :_ROWS], M[:, _ROWS : _ROWS + n] = matrix[pair], right[pair]
        M[:, _ROWS + n :] = 0.0
        for i in range(_ROWS):
            M[i, _ROWS + n + i] = 1.0
        right[pair] = 0.0
        if not is_solvable[pair]:
            continue
        is_solvable[pair] = _scale_columns(M, lengths) and _eliminate(M)
        square = 0.0
        for i in range(_ROWS):
            for k in range(_ROWS + n, 2 * _ROWS + n):
                square += M[i, k] * M[i, k]
        if is_solvable[pair] and SINGULAR_CONTACT * math.sqrt(square) < 1.0:
            for i in range(_ROWS):
                for k in range(n):
                    right[pair, i, k] = M[i, _ROWS + k] / lengths[i]
        else:
            is_solvable[pair] = False
