"""The columns that answers to points are written to, and the memory they are in."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.compiled.places import LAST_PLACE
from scene_graph_ros.geometry.compiled.streams import LINE

__all__ = ["LARGE", "Answers", "new_answers", "write_answer"]

Answers = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]
"""Flat columns phi (k,), p_GN (3 k,), grad_W (3 k,) and unique (k,)."""

LARGE = 1 << 14
"""Answers, of 57 bytes each: from so many on, columns begin where a line of the cache begins."""

_LINE_BYTES = 8 * LINE


def new_answers(count: int, memory: type[np.ndarray[Any, Any]] = np.ndarray) -> Answers:
    """Return flat columns for ``count`` answers, unset.

    ``memory`` is the class of arrays that large ones become.
    """
    if count < LARGE:
        thrice = 3 * count
        return np.empty(count), np.empty(thrice), np.empty(thrice), np.empty(count, np.bool_)

    def column(length: int, kind: Any) -> NDArray[Any]:
        size = length * np.dtype(kind).itemsize
        room = memory((size + _LINE_BYTES,), np.uint8)
        start = -room.ctypes.data % _LINE_BYTES
        return room[start : start + size].view(kind)

    return (
        column(count, np.float64),
        column(3 * count, np.float64),
        column(3 * count, np.float64),
        column(count, np.bool_),
    )


@inlined_kernel
def write_answer(columns, at, phi, nearest, gradient, is_unique):
    """Write one answer to its place in the columns."""
    at &= LAST_PLACE
    columns[0][at], columns[3][at] = phi, is_unique
    at = (3 * at) & LAST_PLACE
    for axis in range(3):
        columns[1][at + axis] = nearest[axis]
        columns[2][at + axis] = gradient[axis]
