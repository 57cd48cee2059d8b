"""The rows of an array that differ from each other, found while other threads go on.

``np.unique`` with an axis compares rows as records, which holds the interpreter: for 0.4 s with
the edges of a mesh of 180 000 triangles. Sorting columns one after another holds it for nothing.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["DistinctRows", "distinct_rows", "used_indices"]


class DistinctRows(NamedTuple):
    """The answer of ``np.unique(..., axis=0)``, of rows without NaN."""

    rows: NDArray[Any]
    """(k, c), in ascending order, the first column first."""
    first: NDArray[np.int64]
    """(k,): where each is first."""
    inverse: NDArray[np.int64]
    """(n,): which of them each given row is."""


def distinct_rows(rows: NDArray[Any]) -> DistinctRows:
    """Return each of ``(n, c)`` rows once; of equal ones, such as 0.0 and -0.0, the first."""
    # Stable, so that equal rows stay in their order.
    order = np.lexsort(rows.T[::-1])
    in_order = rows[order]
    is_new = np.ones(len(rows), dtype=bool)
    is_new[1:] = (in_order[1:] != in_order[:-1]).any(axis=1)
    inverse = np.empty(len(rows), dtype=np.int64)
    inverse[order] = np.cumsum(is_new) - 1
    return DistinctRows(in_order[is_new], order[is_new], inverse)


def used_indices(indices: NDArray[np.int64], count: int) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return the indices below ``count`` that occur, ascending, and all as rows of these."""
    is_used = np.zeros(count, dtype=bool)
    is_used[indices] = True
    row = np.cumsum(is_used) - 1
    return np.flatnonzero(is_used), row[indices]
