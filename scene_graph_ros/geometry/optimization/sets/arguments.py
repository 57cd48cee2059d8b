"""Checks of what callers give: the cleaned array, or an error that names argument and value."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from scene_graph_ros.geometry.optimization.errors import ConvexSetError
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.reals import as_float

__all__ = ["as_matrix", "as_nonnegative", "as_points", "as_vector", "frozen"]

_LIMIT = 1e150
"""Larger numbers would have squares that overflow."""

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
    try:
        array = np.asarray(value)
        if array.dtype.kind not in "fiu" and array.size:
            raise TypeError
        array = array.astype(np.float64)
    except (TypeError, ValueError):
        message = f"{label} must be an array of numbers, not {quoted(value)}"
        raise ConvexSetError(message) from None
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
