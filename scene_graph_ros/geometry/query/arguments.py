"""Checks of queries' arguments: numbers, points, threads."""

from __future__ import annotations

import math
import numbers
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.errors import QueryArgumentError
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.real_arrays import real_array
from scene_graph_ros.geometry.reals import as_float

__all__ = ["checked_flag", "checked_limit", "checked_points", "checked_threads"]

_FEW = 24
"""Numbers. So many are looked at sooner than numpy's loops begin."""


def checked_flag(name: str, value: Any) -> bool:
    """Return True or False. Raises QueryArgumentError for anything else."""
    if not isinstance(value, (bool, np.bool_)):
        raise QueryArgumentError(f"{name} must be True or False, not {quoted(value)}")
    return bool(value)


def checked_limit(name: str, value: Any) -> float:
    """Return a distance in metres, maybe inf. Raises QueryArgumentError."""
    if type(value) is float and value == value:
        return value
    number = as_float(value)
    if number is None or number != number:
        raise QueryArgumentError(f"{name} must be a number of metres: {quoted(value)}")
    return number


def checked_threads(value: Any) -> int:
    """Return the number of threads asked for. Raises QueryArgumentError."""
    if isinstance(value, bool) or not isinstance(value, numbers.Integral) or value < 1:
        raise QueryArgumentError(f"threads must be an integer >= 1: {quoted(value)}")
    return int(value)


def checked_points(name: str, value: ArrayLike, dimensions: int) -> NDArray[np.float64]:
    """Return a C-contiguous copy of points whose last axis has three finite coordinates.

    Raises QueryArgumentError for anything else, and for another number of axes.
    """
    points = real_array(value, f"{name} must be numbers", QueryArgumentError)
    if points.ndim != dimensions or points.shape[-1] != 3:
        expected = "(3,)" if dimensions == 1 else "(m, 3)"
        raise QueryArgumentError(f"{name} must have shape {expected}, not {points.shape}")
    if not _are_finite(points):
        row = int(np.flatnonzero(~np.isfinite(points.reshape(-1, 3)).all(axis=1))[0])
        bad = points.reshape(-1, 3)[row].tolist()
        raise QueryArgumentError(f"{name} must be finite: row {row} is {bad}")
    return points


def _are_finite(points: NDArray[np.float64]) -> bool:
    if points.size <= _FEW:
        return all(map(math.isfinite, points.ravel().tolist()))
    return bool(np.isfinite(points).all())
