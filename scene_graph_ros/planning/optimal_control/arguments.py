"""Checks of arguments of trajectory optimizations; errors name argument and value."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.number_checks import bounds, nonnegative, positive
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.real_arrays import real_array
from scene_graph_ros.planning.optimal_control.errors import TrajectoryOptimizationError

__all__ = ["as_bounds", "as_count", "as_index", "as_nonnegative", "as_positive", "as_vector"]


def as_count(name: str, value: Any, least: int) -> int:
    """Return a whole number, at least ``least``. Raises TrajectoryOptimizationError."""
    is_whole = isinstance(value, (int, np.integer)) and not isinstance(value, bool)
    if not is_whole or value < least:
        raise TrajectoryOptimizationError(
            f"{name} must be a whole number, at least {least}, not {quoted(value)}"
        )
    return int(value)


def as_index(name: str, value: Any, size: int) -> int:
    """Return a place among ``size``. Raises TrajectoryOptimizationError."""
    k = as_count(name, value, 0)
    if k >= size:
        raise TrajectoryOptimizationError(f"{name} must be below {size}, not {k}")
    return k


def as_positive(name: str, value: Any) -> float:
    """Return a positive, finite number. Raises TrajectoryOptimizationError."""
    return positive(name, value, TrajectoryOptimizationError)


def as_nonnegative(name: str, value: Any) -> float:
    """Return a finite number from 0 on. Raises TrajectoryOptimizationError."""
    return nonnegative(name, value, TrajectoryOptimizationError)


def as_vector(name: str, value: Any, size: int | None = None) -> NDArray[np.float64]:
    """Return finite numbers ``(size,)``. Raises TrajectoryOptimizationError."""
    array = real_array(value, f"{name} must be numbers", TrajectoryOptimizationError)
    if array.ndim != 1 or (size is not None and array.size != size):
        wanted = "(n,)" if size is None else f"({size},)"
        raise TrajectoryOptimizationError(f"{name} must have shape {wanted}, not {array.shape}")
    if not np.isfinite(array).all():
        k = int(np.argmin(np.isfinite(array)))
        raise TrajectoryOptimizationError(f"{name}[{k}] must be finite, not {array[k]}")
    return array


def as_bounds(lb: Any, ub: Any, size: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return bounds ``(size,)``, of single numbers too; infinite ones don't bound.

    Raises TrajectoryOptimizationError for bounds that are empty or no numbers.
    """
    return bounds(lb, ub, size, TrajectoryOptimizationError, is_broad=True)
