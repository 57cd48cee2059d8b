"""Which boxes overlap, directly or by way of others."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["groups_of_boxes"]


def groups_of_boxes(
    lower: NDArray[np.float64], upper: NDArray[np.float64]
) -> list[NDArray[np.int64]]:
    """Return the rows of (n, 3) boxes in groups: those that touch are in one, and so on."""
    n = len(lower)
    group = np.arange(n)

    def root(i: int) -> int:
        while group[i] != i:
            group[i] = group[group[i]]
            i = int(group[i])
        return i

    order = np.argsort(lower[:, 0], kind="stable")
    low, high = lower[order], upper[order]
    ends = np.searchsorted(low[:, 0], high[:, 0], side="right")
    for i in range(n):
        others = slice(i + 1, ends[i])
        meets = (low[others, 1:] <= high[i, 1:]).all(axis=1)
        meets &= (high[others, 1:] >= low[i, 1:]).all(axis=1)
        for j in np.flatnonzero(meets) + i + 1:
            a, b = root(int(order[i])), root(int(order[j]))
            group[max(a, b)] = min(a, b)
    roots = np.array([root(i) for i in range(n)], dtype=np.int64)
    in_order = np.argsort(roots, kind="stable")
    starts = np.flatnonzero(np.diff(roots[in_order], prepend=-1))
    return np.split(in_order, starts[1:]) if n else []
