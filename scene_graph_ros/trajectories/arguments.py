"""Checks of arguments: the cleaned array or number, or an error that names it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.number_checks import positive, whole
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.real_arrays import real_array
from scene_graph_ros.geometry.reals import as_float
from scene_graph_ros.trajectories.errors import TrajectoryError

__all__ = [
    "as_breaks",
    "as_finite",
    "as_numbers",
    "as_order",
    "as_positive",
    "as_times",
    "is_same_time",
]

_SAME_TIME = 1e-12
"""Relative to the larger of two times, and s: breaks that are so near are the same."""


def as_numbers(name: str, values: ArrayLike) -> NDArray[np.float64]:
    """Return an array of finite numbers of any shape. Raises TrajectoryError."""
    array = real_array(values, f"{name} must be numbers", TrajectoryError)
    if not np.isfinite(array).all():
        where = tuple(map(int, np.argwhere(~np.isfinite(array))[0]))
        raise TrajectoryError(f"{name}{list(where)} must be finite, not {array[where]}")
    return array


def as_times(t: ArrayLike) -> NDArray[np.float64]:
    """Return a time ``()`` or times ``(m,)``. Raises TrajectoryError."""
    times = as_numbers("t", t)
    if times.ndim > 1:
        raise TrajectoryError(f"t must be a number or have shape (m,), not {times.shape}")
    return times


def as_finite(name: str, value: Any) -> float:
    """Return a finite number. Raises TrajectoryError."""
    number = as_float(value)
    if number is None or not abs(number) < np.inf:
        raise TrajectoryError(f"{name} must be a finite number, not {quoted(value)}")
    return number


def as_positive(name: str, value: Any) -> float:
    """Return a positive, finite number. Raises TrajectoryError."""
    return positive(name, value, TrajectoryError)


def as_order(name: str, value: Any, least: int = 0) -> int:
    """Return a whole number, at least ``least``. Raises TrajectoryError."""
    return whole(name, value, TrajectoryError, least)


def as_breaks(values: ArrayLike, name: str = "breaks") -> NDArray[np.float64]:
    """Return times ``(p + 1,)`` that grow, p at least 1. Raises TrajectoryError."""
    breaks = as_numbers(name, values)
    if breaks.ndim != 1 or len(breaks) < 2:
        raise TrajectoryError(f"{name} must be two numbers or more, not {breaks.shape}")
    if not (np.diff(breaks) > 0.0).all():
        i = int(np.argmin(np.diff(breaks)))
        raise TrajectoryError(f"{name} must grow: {breaks[i]} is before {breaks[i + 1]}")
    return breaks


def is_same_time(first: float, second: float) -> bool:
    """Tell whether two times differ by no more than rounding."""
    near = _SAME_TIME * max(1.0, abs(first), abs(second))
    # No finite time is near an infinite one.
    return first == second or abs(first - second) <= near < np.inf
