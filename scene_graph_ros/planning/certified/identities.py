"""Both sides of a certificate's identities, exactly, and whether matrices are semidefinite."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
import math
import operator
from typing import TypeAlias

from scene_graph_ros.planning.certified.polynomials import (
    Exponents,
    Polynomial,
    sum_of_products,
)

__all__ = [
    "ExactMatrix",
    "Matrix",
    "exact",
    "gram_sum",
    "is_positive_semidefinite",
    "normal_residuals",
]


@dataclass(frozen=True)
class ExactMatrix:
    """Whole numbers, line by line, over one common denominator; its lines are of fractions."""

    whole: list[list[int]]
    common: int

    def __len__(self) -> int:
        return len(self.whole)

    def __iter__(self) -> Iterator[list[Fraction]]:
        return ([Fraction(v, self.common) for v in line] for line in self.whole)


Matrix: TypeAlias = ExactMatrix | list[list[Fraction]]


def exact(matrix: Matrix) -> ExactMatrix:
    """Return a matrix as whole numbers."""
    if isinstance(matrix, ExactMatrix):
        return matrix
    common = math.lcm(*(v.denominator for row in matrix for v in row))
    return ExactMatrix(
        [[v.numerator * (common // v.denominator) for v in row] for row in matrix], common
    )


def gram_sum(
    matrices: Sequence[Matrix], rows: Sequence[Polynomial], basis: Sequence[Exponents]
) -> Polynomial:
    """Return ``sum over rows of row(u) m(u)' G m(u)``."""
    products = [[tuple(map(operator.add, e, f)) for f in basis] for e in basis]
    return sum_of_products(
        (1, _gram_polynomial(exact(matrix), products), row)
        for matrix, row in zip(matrices, rows, strict=True)
    )


def _gram_polynomial(matrix: ExactMatrix, products: list[list[Exponents]]) -> Polynomial:
    """Return ``m(u)' G m(u)``."""
    result: dict[Exponents, int] = {}
    for line, own in zip(matrix.whole, products, strict=True):
        for value, e in zip(line, own, strict=True):
            result[e] = result.get(e, 0) + value
    return Polynomial(result, matrix.common)


def normal_residuals(
    matrices: Sequence[Matrix], plane: Sequence[Sequence[Fraction]]
) -> list[ExactMatrix]:
    """Return what ``[[1, a'], [a, 1]]`` is more than the sum of a normal's Gram matrices.

    The constant part first, then the factors of each variable.
    """
    given = [exact(matrix) for matrix in matrices]
    normal = plane[:3]
    common = math.lcm(
        *(matrix.common for matrix in given), *(v.denominator for row in normal for v in row)
    )
    result = []
    for k in range(len(plane[0])):
        rows = [[common * int(i == j and k == 0) for j in range(4)] for i in range(4)]
        for i, row in enumerate(normal, 1):
            value = row[k].numerator * (common // row[k].denominator)
            rows[0][i] += value
            rows[i][0] += value
        signs = [(m, 1) for m in given] if k == 0 else [(given[2 * k - 1], 1), (given[2 * k], -1)]
        for matrix, sign in signs:
            factor = sign * (common // matrix.common)
            rows = [
                [v - factor * w for v, w in zip(line, own, strict=True)]
                for line, own in zip(rows, matrix.whole, strict=True)
            ]
        result.append(ExactMatrix(rows, common))
    return result


def is_positive_semidefinite(matrix: Matrix) -> bool:
    """Tell whether a matrix is symmetric and has no negative eigenvalue.

    By elimination without fractions (Bareiss, "Sylvester's identity and multistep
    integer-preserving Gaussian elimination", 1968), whose pivots are the leading minors.
    """
    size = len(matrix)
    rows = [list(row) for row in exact(matrix).whole]
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
            rest = [row[k + 1 :] for row in rows[k + 1 :]]
            return is_positive_semidefinite(ExactMatrix(rest, 1))
        line = rows[k]
        for i in range(k + 1, size):
            own, first = rows[i], rows[i][k]
            # What is above the diagonal is enough: what is left is symmetric.
            for j in range(i, size):
                own[j] = rows[j][i] = (own[j] * pivot - first * line[j]) // before
        before = pivot
    return True
