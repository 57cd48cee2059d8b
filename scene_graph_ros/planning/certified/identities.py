"""Both sides of a certificate's identities, exactly, and whether matrices are semidefinite."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
import math
import operator
from typing import TypeAlias

from scene_graph_ros.planning.certified.polynomials import (
    Exponents,
    fractions,
    linear,
    Polynomial,
    sum_of_products,
)
from scene_graph_ros.planning.certified.tangent_region import Row

__all__ = ["Matrix", "gram_sum", "is_positive_semidefinite", "normal_residuals"]

Matrix: TypeAlias = list[list[Fraction]]


def gram_sum(
    matrices: Sequence[Matrix], rows: Sequence[Row], basis: Sequence[Exponents]
) -> Polynomial:
    """Return ``sum over rows of row(u) m(u)' G m(u)``."""
    products = [[tuple(map(operator.add, e, f)) for f in basis] for e in basis]
    return sum_of_products(
        (1, _gram_polynomial(matrix, products), linear(offset, slopes))
        for matrix, (offset, slopes) in zip(matrices, rows, strict=True)
    )


def _gram_polynomial(matrix: Matrix, products: list[list[Exponents]]) -> Polynomial:
    """Return ``m(u)' G m(u)``."""
    common = math.lcm(*(v.denominator for row in matrix for v in row))
    result: dict[Exponents, int] = {}
    for line, own in zip(matrix, products, strict=True):
        for value, e in zip(line, own, strict=True):
            if value:
                whole = value.numerator * (common // value.denominator)
                result[e] = result.get(e, 0) + whole
    return fractions(result, common)


def normal_residuals(
    matrices: Sequence[Matrix], plane: Sequence[Sequence[Fraction]]
) -> list[Matrix]:
    """Return what ``[[1, a'], [a, 1]]`` is more than the sum of a normal's Gram matrices.

    The constant part first, then the factors of each variable.
    """
    result = []
    for k in range(len(plane[0])):
        rows = [[Fraction(int(i == j and k == 0)) for j in range(4)] for i in range(4)]
        for i in range(3):
            rows[0][i + 1] += plane[i][k]
            rows[i + 1][0] += plane[i][k]
        parts = (
            [(m, 1) for m in matrices]
            if k == 0
            else [(matrices[2 * k - 1], 1), (matrices[2 * k], -1)]
        )
        for matrix, sign in parts:
            for i in range(4):
                for j in range(4):
                    rows[i][j] -= sign * matrix[i][j]
        result.append(rows)
    return result


def is_positive_semidefinite(matrix: Matrix) -> bool:
    """Tell whether a matrix is symmetric and has no negative eigenvalue.

    By elimination without fractions (Bareiss, "Sylvester's identity and multistep
    integer-preserving Gaussian elimination", 1968), whose pivots are the leading minors.
    """
    size = len(matrix)
    common = math.lcm(*(v.denominator for row in matrix for v in row))
    rows = [[v.numerator * (common // v.denominator) for v in row] for row in matrix]
    if any(len(row) != size for row in rows):
        return False
    if any(rows[i][j] != rows[j][i] for i in range(size) for j in range(i)):
        return False
    before = 1
    for k in range(size):
        pivot = rows[k][k]
        if pivot < 0:
            return False
        if pivot == 0:
            if any(rows[k][k + 1 :]):
                return False
            # The row is zero, and so is what it would take from the others.
            return (
                is_positive_semidefinite(
                    [[Fraction(v) for v in row[k + 1 :]] for row in rows[k + 1 :]]
                )
                if k + 1 < size
                else True
            )
        for i in range(k + 1, size):
            for j in range(k + 1, size):
                rows[i][j] = (rows[i][j] * pivot - rows[i][k] * rows[k][j]) // before
        before = pivot
    return True
