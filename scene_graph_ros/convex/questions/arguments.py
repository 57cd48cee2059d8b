"""Checks of arguments: the cleaned array, or an error that names argument and value."""

from __future__ import annotations

from collections.abc import Iterable
import math
from typing import Any

import numpy as np

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.real_arrays import real_array
from scene_graph_ros.geometry.reals import as_float

__all__ = [
    "as_corners_dimension",
    "as_generator",
    "as_list",
    "as_matrix",
    "as_nonnegative",
    "as_number",
    "as_points",
    "as_vector",
    "as_whole",
    "frozen",
]

_LIMIT = 1e150
"""Larger numbers would have squares that overflow."""

_MOST_CORNERS_DIMENSION = 20
"""Of what has 2^n corners or faces: more are no numbers to keep."""

_FEW = 8192
"""Numbers: for many more, BLAS takes threads, which spin."""


def frozen(array: np.ndarray) -> np.ndarray:
    """Return a copy that can't be written."""
    copy = np.array(array, dtype=np.float64, order="C")
    copy.setflags(write=False)
    return copy


def _are_small(array: np.ndarray) -> bool:
    """Tell whether few numbers are surely all below the limit, sooner than by asking of each."""
    flat = array.ravel()
    return len(flat) <= _FEW and bool(flat.dot(flat) < _LIMIT)


def _numbers(value: Any, label: str) -> np.ndarray:
    """Return an array of floats below the limit, which may be the caller's own."""
    if type(value) is np.ndarray and value.dtype == np.float64 and _are_small(value):
        return value
    array = real_array(value, f"{label} must be an array of numbers", ConvexSetError)
    if not (np.abs(array) < _LIMIT).all():
        bad = array[~(np.abs(array) < _LIMIT)].flat[0]
        raise ConvexSetError(
            f"{label} must hold finite numbers below {_LIMIT:g}, not {float(bad)!r}; leave out"
            " rows that bound nothing"
        )
    return array


def as_vector(value: Any, label: str, size: int | None = None) -> np.ndarray:
    """Return a vector ``(size,)`` of finite numbers. Raises ConvexSetError."""
    array = _numbers(value, label)
    if array.ndim != 1 or (size is not None and len(array) != size):
        wanted = "(n,)" if size is None else f"({size},)"
        raise ConvexSetError(f"{label} must have the shape {wanted}, not {array.shape}")
    return frozen(array)


def as_matrix(value: Any, label: str, columns: int | None = None) -> np.ndarray:
    """Return a matrix ``(m, columns)`` of finite numbers. Raises ConvexSetError."""
    array = _numbers(value, label)
    if array.ndim != 2 or (columns is not None and array.shape[1] != columns):
        wanted = f"(m, {'n' if columns is None else columns})"
        raise ConvexSetError(f"{label} must have the shape {wanted}, not {array.shape}")
    return frozen(array)


def as_points(value: Any, label: str, dimension: int) -> tuple[np.ndarray, bool]:
    """Return points ``(m, n)``, and whether only one came, ``(n,)``. Raises ConvexSetError."""
    array = _numbers(value, label)
    is_one = array.ndim == 1
    points = array[None] if is_one else array
    if points.ndim != 2 or points.shape[1] != dimension:
        raise ConvexSetError(
            f"{label} must be a point ({dimension},) or points (m, {dimension}), as rows, not"
            f" {array.shape}"
        )
    return np.array(points, order="C"), is_one


def as_nonnegative(value: Any, label: str) -> float:
    """Return a finite number that is not negative. Raises ConvexSetError."""
    number = as_float(value)
    if number is None or not 0.0 <= number < math.inf:
        raise ConvexSetError(f"{label} must be a finite number, at least 0, not {quoted(value)}")
    return number


def as_number(value: Any, label: str) -> float:
    """Return a number, which may be negative or infinite. Raises ConvexSetError."""
    number = value if type(value) is float else as_float(value)
    if number is None or number != number:
        raise ConvexSetError(f"{label} must be a number, not {quoted(value)}")
    return number


def as_whole(value: Any, label: str, least: int = 0, most: int | None = None) -> int:
    """Return a whole number, at least ``least``, at most ``most``. Raises ConvexSetError."""
    is_whole = isinstance(value, (int, np.integer)) and not isinstance(value, bool)
    if not is_whole or value < least or (most is not None and value > most):
        limit = "" if most is None else f" and at most {most}"
        raise ConvexSetError(
            f"{label} must be a whole number, at least {least}{limit}, not {quoted(value)}"
        )
    return int(value)


def as_corners_dimension(value: Any, label: str) -> int:
    """Return the dimension of a set with 2^n corners or faces. Raises ConvexSetError."""
    return as_whole(value, label, 0, _MOST_CORNERS_DIMENSION)


def as_generator(value: Any, label: str) -> np.random.Generator:
    """Return NumPy's generator of random numbers. Raises ConvexSetError for another object."""
    if not isinstance(value, np.random.Generator):
        raise ConvexSetError(
            f"{label} must be a numpy.random.Generator, such as numpy.random.default_rng(0), not"
            f" {quoted(value)}"
        )
    return value


def as_list(value: Any, label: str) -> list[Any]:
    """Return an iterable as a list. Raises ConvexSetError."""
    if not isinstance(value, Iterable):
        raise ConvexSetError(f"{label} must be a list, not {quoted(value)}")
    return list(value)
