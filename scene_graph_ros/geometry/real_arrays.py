"""The border for arrays: all that NumPy calls numbers becomes an array that kernels take."""

from __future__ import annotations

import numbers
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.quoting import quoted

__all__ = ["complex_array", "real_array", "whole_array"]

_FLOAT64 = np.dtype(np.float64)


def real_array(value: Any, rule: str, error: type[Exception]) -> NDArray[np.float64]:
    """Return numbers as a new ``float64`` array of any shape, C-ordered and writeable.

    ``value`` may have any layout, byte order and type of real numbers, also of Python's objects.
    Raises ``error``, which begins with ``rule`` ("radii must be numbers") and names type and
    shape, for text, times, complex numbers, integers beyond all floats, and entries that are
    masked.
    """
    if type(value) is np.ndarray and value.dtype is _FLOAT64:
        return value.copy()  # in the order of C, unless it is told otherwise
    result: NDArray[np.float64] = _array(value, rule, error, "fiub", numbers.Real)
    return result


def complex_array(value: Any, rule: str, error: type[Exception]) -> NDArray[np.complex128]:
    """Return numbers as a new ``complex128`` array, of all that `real_array` takes, or complex."""
    result: NDArray[np.complex128] = _array(value, rule, error, "cfiub", numbers.Complex)
    return result


def whole_array(value: Any, rule: str, error: type[Exception]) -> NDArray[np.int64]:
    """Return whole numbers as a new ``int64`` array, of all that `real_array` takes.

    Raises ``error`` also for fractions, and for floats from 2^53 on.
    """
    found = real_array(value, rule, error)
    given = np.asarray(value)
    if given.dtype.kind == "i" or (given.dtype.kind == "u" and (given < 2**63).all()):
        return np.array(given, dtype=np.int64, order="C")
    if not (np.abs(found) < 2.0**53).all() or (found != np.rint(found)).any():
        raise error(f"{rule}: {quoted(value)}")
    return found.astype(np.int64)


def _array(value: Any, rule: str, error: type[Exception], kinds: str, of: type) -> NDArray[Any]:
    """Return numbers of some kinds of types, or that are objects of a class, as a new array."""
    try:
        given = np.asanyarray(value)
        if _is_of(given, kinds, of):
            dtype = np.complex128 if "c" in kinds else np.float64
            with np.errstate(over="ignore"):
                return np.array(given, dtype=dtype, order="C", subok=False)
    except (TypeError, ValueError, OverflowError) as cause:
        raise error(f"{rule}: {quoted(value)}") from cause
    kind = f"{given.dtype} of shape {given.shape}"
    raise error(f"{rule}: {quoted(value)}, which is {kind}{_masked(given)}")


def _is_of(given: NDArray[Any], kinds: str, of: type) -> bool:
    if _masked(given):
        return False
    if given.dtype.kind == "O":
        return all(isinstance(each, (of, np.bool_)) for each in given.flat)
    return given.dtype.kind in kinds


def _masked(given: NDArray[Any]) -> str:
    return " with masked entries" if np.ma.is_masked(given) else ""
