"""Checks of arguments of trajectories through graphs; errors name argument and value."""

from __future__ import annotations

from typing import Any

import numpy as np

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.convex.questions.arguments import as_matrix, as_nonnegative
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.real_arrays import real_array

__all__ = ["as_bounds", "as_count", "as_weights"]


def as_count(value: Any, least: int, label: str) -> int:
    """Return a whole number, at least ``least``. Raises ConvexSetError."""
    is_whole = isinstance(value, (int, np.integer)) and not isinstance(value, bool)
    if not is_whole or value < least:
        raise ConvexSetError(
            f"{label} must be a whole number, at least {least}, not {quoted(value)}"
        )
    return int(value)


def as_bounds(lb: Any, ub: Any, size: int, label: str) -> tuple[np.ndarray, np.ndarray]:
    """Return bounds ``(size,)``; infinite ones don't bound. Raises ConvexSetError."""
    found = []
    for name, value, forbidden in (("lb", lb, np.inf), ("ub", ub, -np.inf)):
        array = real_array(value, f"{label}: {name} must be numbers", ConvexSetError)
        if array.shape != (size,):
            raise ConvexSetError(
                f"{label}: {name} must have the shape ({size},), not {array.shape}"
            )
        bad = np.isnan(array) | (array == forbidden)
        if bad.any():
            k = int(np.argmax(bad))
            raise ConvexSetError(f"{label}: {name}[{k}] must bound something, not {array[k]}")
        found.append(array)
    if (found[0] > found[1]).any():
        k = int(np.argmax(found[0] > found[1]))
        raise ConvexSetError(
            f"{label}: lb[{k}] = {found[0][k]} must not be above ub[{k}] = {found[1][k]}"
        )
    return found[0], found[1]


def as_weights(weight: Any, size: int, label: str) -> np.ndarray:
    """Return a matrix ``(size, size)``; a number is that of each entry. Raises ConvexSetError."""
    if real_array(weight, f"{label}: weight must be numbers", ConvexSetError).ndim == 0:
        return as_nonnegative(weight, f"{label}: weight") * np.eye(size)
    matrix = as_matrix(weight, f"{label}: weight", size)
    if len(matrix) != size:
        raise ConvexSetError(
            f"{label}: weight must have the shape ({size}, {size}), not {matrix.shape}"
        )
    return matrix
