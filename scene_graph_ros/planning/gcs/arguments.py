"""Checks of arguments of trajectories through graphs; errors name argument and value."""

from __future__ import annotations

from typing import Any

import numpy as np

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.convex.questions.arguments import as_matrix, as_nonnegative
from scene_graph_ros.geometry.number_checks import bounds
from scene_graph_ros.geometry.real_arrays import real_array

__all__ = ["as_bounds", "as_weights"]


def as_bounds(lb: Any, ub: Any, size: int, label: str) -> tuple[np.ndarray, np.ndarray]:
    """Return bounds ``(size,)``; infinite ones don't bound. Raises ConvexSetError."""
    return bounds(lb, ub, size, ConvexSetError, label=f"{label}: ")


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
