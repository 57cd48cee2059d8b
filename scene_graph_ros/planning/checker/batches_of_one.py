"""One configuration or edge as a batch of one."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.real_arrays import real_array
from scene_graph_ros.planning.errors import CollisionCheckerError

__all__ = ["one_configuration", "one_edge"]


def one_configuration(name: str, q: ArrayLike) -> NDArray[np.float64]:
    """Return one configuration as a batch of one."""
    array = real_array(q, f"{name} must be numbers", CollisionCheckerError)
    if array.ndim != 1:
        raise CollisionCheckerError(f"{name} must have shape (nq,), not {array.shape}")
    return array[np.newaxis]


def one_edge(q1: ArrayLike, q2: ArrayLike) -> NDArray[np.float64]:
    """Return one edge as a batch of one; raises CollisionCheckerError for uneven ends."""
    first, second = one_configuration("q1", q1), one_configuration("q2", q2)
    if first.shape != second.shape:
        raise CollisionCheckerError(
            f"q1 and q2 must have the same shape, not {first[0].shape} and {second[0].shape}"
        )
    return np.stack([first[0], second[0]])[np.newaxis]
