"""Matrices of whole numbers over one denominator, and whether they are semidefinite: exactly."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
import math
from typing import Any, NamedTuple, overload, TypeAlias

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "ExactArray",
    "ExactMatrix",
    "ExactStack",
    "Matrix",
    "are_positive_semidefinite",
    "exact_array",
    "is_positive_semidefinite",
    "stacked",
    "summable",
]

_SAFE = 2**62
"""Sums that stay below it in size are exact in int64."""


class ExactArray(NamedTuple):
    """Whole numbers of any size (an array of objects, or int64) over one common denominator."""

    whole: NDArray[Any]
    common: int

    def floats(self) -> NDArray[np.float64]:
        """Return the nearest floats."""
        return np.asarray(self.whole.astype(object) / self.common, dtype=np.float64)


def exact_array(values: NDArray[np.float64] | Sequence[Sequence[Fraction]]) -> ExactArray:
    """Return floats or fractions ``(i, k)`` as they are."""
    lines = values.tolist() if isinstance(values, np.ndarray) else values
    ratios = [[v.as_integer_ratio() for v in line] for line in lines]
    common = math.lcm(*(below for line in ratios for _, below in line))
    whole = [[above * (common // below) for above, below in line] for line in ratios]
    return ExactArray(np.array(whole, dtype=object), common)


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


@dataclass(frozen=True, eq=False)
class ExactStack(Sequence[ExactMatrix]):
    """Matrices ``(r, m, m)`` of whole numbers over one common denominator."""

    whole: NDArray[Any]
    common: int

    @property
    def is_exact(self) -> bool:
        """Whether these are whole numbers over a positive one, and not floats or short words."""
        if type(self.common) is not int or self.common < 1:
            return False
        if self.whole.dtype == object:
            return all(type(v) is int for v in self.whole.reshape(-1).tolist())
        return bool(self.whole.dtype == np.int64)

    def __len__(self) -> int:
        return len(self.whole)

    @overload
    def __getitem__(self, index: int) -> ExactMatrix: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[ExactMatrix]: ...
    def __getitem__(self, index: int | slice) -> ExactMatrix | Sequence[ExactMatrix]:
        if isinstance(index, slice):
            return ExactStack(self.whole[index], self.common)
        return ExactMatrix(self.whole[index].tolist(), self.common)


def stacked(parts: Sequence[Sequence[Matrix]], count: int, order: int) -> ExactArray | None:
    """Return ``count`` matrices of an order of each part, ``(p, r, m, m)``; None for others.

    Also for floats that only look like whole numbers.
    """
    if any(len(part) != count for part in parts):
        return None
    stacks = []
    for part in parts:
        if isinstance(part, ExactStack):
            if not part.is_exact:
                return None
            stacks.append(ExactArray(part.whole, part.common))
            continue
        lines = [[*row] for matrix in part for row in matrix]
        if any(len(matrix) != order for matrix in part) or any(len(r) != order for r in lines):
            return None
        flat = exact_array(lines)
        stacks.append(ExactArray(flat.whole.reshape(count, order, order), flat.common))
    if any(each.whole.shape != (count, order, order) for each in stacks):
        return None
    common = math.lcm(*(each.common for each in stacks))
    if all(each.common == common for each in stacks):
        return ExactArray(np.array([each.whole for each in stacks]), common)
    return ExactArray(
        np.array([each.whole.astype(object) * (common // each.common) for each in stacks]), common
    )


def summable(whole: NDArray[Any], count: int) -> NDArray[Any]:
    """Return whole numbers such that sums of ``count`` of them are exact."""
    if whole.dtype == object or not whole.size:
        return whole
    largest = max(int(whole.max()), -int(whole.min()))
    return whole if largest * count < _SAFE else whole.astype(object)


def are_positive_semidefinite(matrices: NDArray[Any]) -> bool:
    """Tell whether all of some matrices ``(r, m, m)`` of whole numbers are semidefinite.

    As `is_positive_semidefinite` does, all of them step by step.
    """
    if not np.array_equal(matrices, matrices.transpose(0, 2, 1)):
        return False
    matrices, size = matrices[(matrices != 0).any(axis=(1, 2))], matrices.shape[1]
    if size == 1:
        return bool((matrices >= 0).all())
    rows = np.ascontiguousarray(np.moveaxis(matrices.astype(object), 0, -1))
    before: Any = None
    is_singular = np.zeros(len(matrices), dtype=np.bool_)
    for k in range(size):
        pivot = rows[k, k].copy()
        if (pivot[~is_singular] < 0).any():
            return False
        is_singular |= pivot == 0
        pivot[is_singular] = 1  # these are decided one by one
        for i in range(k + 1, size):
            change = rows[i, i:] * pivot - rows[k, i] * rows[k, i:]
            rows[i, i:] = change if before is None else change // before
        before = pivot
    return all(
        is_positive_semidefinite(ExactMatrix(matrices[k].tolist(), 1))
        for k in np.flatnonzero(is_singular)
    )


def _exact(matrix: Matrix) -> ExactMatrix:
    """Return a matrix as whole numbers."""
    if isinstance(matrix, ExactMatrix):
        return matrix
    common = math.lcm(*(v.denominator for row in matrix for v in row))
    return ExactMatrix(
        [[v.numerator * (common // v.denominator) for v in row] for row in matrix], common
    )


def is_positive_semidefinite(matrix: Matrix) -> bool:
    """Tell whether a matrix is symmetric and has no negative eigenvalue.

    By elimination without fractions (Bareiss, "Sylvester's identity and multistep
    integer-preserving Gaussian elimination", 1968), whose pivots are the leading minors.
    """
    size = len(matrix)
    rows = [list(row) for row in _exact(matrix).whole]
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
