"""The columns that answers to points are written to, and the memory they are in."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.query.point.lane_memory import LINE

__all__ = ["LARGE", "Answers", "new_answers"]

Answers = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]
"""Flat columns phi (k,), p_GN (3 k,), grad_W (3 k,) and unique (k,)."""

LARGE = 1 << 14
"""Answers, of 57 bytes each: from so many on, columns begin where a line of the cache begins."""

_LINE_BYTES = 8 * LINE


def new_answers(count: int) -> Answers:
    """Return flat columns for ``count`` answers, unset.

    From ``LARGE`` answers on, each is a view of an array that nobody else has.
    """
    new = _lined if count >= LARGE else np.empty
    return (
        new(count, np.float64),
        new(3 * count, np.float64),
        new(3 * count, np.float64),
        new(count, np.bool_),
    )


def _lined(count: int, kind: Any) -> NDArray[Any]:
    """Return an array that begins where a line of the cache does."""
    size = count * np.dtype(kind).itemsize
    memory = np.empty(size + _LINE_BYTES, np.uint8)
    start = -memory.ctypes.data % _LINE_BYTES
    return memory[start : start + size].view(kind)
