"""Sizes of a lift's variables, and rows of length 1."""

from __future__ import annotations

import numpy as np

__all__ = ["normalized", "spread"]


def spread(rows: np.ndarray, sides: np.ndarray, sizes: np.ndarray) -> None:
    """Fill the sizes ``(k,)`` that are NaN, from those that are known: each by rows with some.

    In a row a variable is about as large as the known ones, or else as the right side.
    """
    while np.isnan(sizes).any():
        known = np.where(np.isnan(sizes), 0.0, sizes)
        terms = (rows * known).max(axis=1, initial=0.0)
        found = {}
        for scale in (terms, sides):
            for k in np.flatnonzero(np.isnan(sizes)):
                here = (rows[:, k] > 0.0) & (scale > 0.0)
                if here.any():
                    found[k] = float((scale[here] / rows[here, k]).min())
            if found:
                break
        for k in np.flatnonzero(np.isnan(sizes)):
            if k in found or not found:
                sizes[k] = found.get(k, 1.0)


def normalized(rows: np.ndarray, sides: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return rows of length 1, without those that are zero."""
    lengths = np.linalg.norm(rows, axis=1)
    kept = lengths > 0.0
    return rows[kept] / lengths[kept, None], sides[kept] / lengths[kept]
