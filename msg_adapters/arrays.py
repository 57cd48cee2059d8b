"""Numpy arrays to and from the flat sequences of messages, by block copies."""

from array import array
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from msg_adapters.errors import MessageError

__all__ = [
    "float64s_to_msg",
    "int64s_to_msg",
    "rows_from_msg",
    "uint8s_to_msg",
    "uint32s_to_msg",
    "uint64s_to_msg",
]


def _to_array(typecode: str, dtype: Any, values: ArrayLike) -> array:
    return array(typecode, np.ascontiguousarray(values, dtype=dtype).tobytes())


def float64s_to_msg(values: ArrayLike) -> array:
    """Return values of any shape, row-major, for a ``float64[]`` field."""
    return _to_array("d", np.float64, values)


def int64s_to_msg(values: ArrayLike) -> array:
    """Return values for an ``int64[]`` field."""
    return _to_array("q", np.int64, values)


def uint64s_to_msg(values: ArrayLike) -> array:
    """Return values for a ``uint64[]`` field."""
    return _to_array("Q", np.uint64, values)


def uint32s_to_msg(values: ArrayLike) -> array:
    """Return values for a ``uint32[]`` field."""
    return _to_array("I", np.uint32, values)


def uint8s_to_msg(values: ArrayLike) -> array:
    """Return values for a ``uint8[]`` field; booleans become 0 and 1."""
    return _to_array("B", np.uint8, values)


def rows_from_msg(values: Sequence[float] | array, width: int, name: str) -> NDArray[np.float64]:
    """Return a ``(len(values) / width, width)`` copy of a flat field.

    Raises MessageError where the length is no multiple of ``width`` or a value is not finite.
    """
    flat = np.array(values, dtype=np.float64)
    if len(flat) % width:
        raise MessageError(f"{name} has {len(flat)} numbers, which is no multiple of {width}")
    rows = flat.reshape(-1, width)
    finite = np.isfinite(rows).all(axis=1)
    if not finite.all():
        row = int(np.argmin(finite))
        raise MessageError(f"{name}: row {row} is not finite: {rows[row].tolist()}")
    return rows
