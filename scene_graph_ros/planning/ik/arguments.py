"""Checks of arguments of searches for configurations."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.number_checks import whole
from scene_graph_ros.geometry.real_arrays import real_array
from scene_graph_ros.planning.ik.pose_target import InverseKinematicsError
from scene_graph_ros.robots.kinematic_tree import KinematicTree
from scene_graph_ros.robots.tree_kernels import FLOATING

__all__ = ["first_configurations", "whole_number"]


def whole_number(name: str, value: Any, *, least: int = 0) -> int:
    """Return it. Raises InverseKinematicsError unless it is a whole number from ``least`` on."""
    return whole(name, value, InverseKinematicsError, least)


def first_configurations(
    tree: KinematicTree, near: ArrayLike | None, count: int | None = None, *, name: str = "near"
) -> NDArray[np.float64]:
    """Return a copy of ``near`` for each of so many poses ``(count, nq)``, by default zero.

    ``near`` is ``(nq,)``, or with a ``count`` also ``(count, nq)``. Quaternions get length 1.
    Raises InverseKinematicsError for another shape, KinematicTreeError for values that are no
    configuration.
    """
    if near is None:
        near = np.clip(tree.zero_configuration(), tree.lower, tree.upper)
    array = real_array(near, f"{name} must be numbers", InverseKinematicsError)
    shape = array.shape
    if len(shape) != 1 and not (count is not None and len(shape) == 2 and shape[0] == count):
        more = "" if count is None else f" or ({count}, nq)"
        raise InverseKinematicsError(f"{name} must have shape (nq,){more}, not {shape}")
    q = tree.checked_configurations(array)
    for start in tree.table.starts[1:][tree.table.kinds[1:] == FLOATING]:
        parts = q[:, start : start + 4]
        q = q.copy()
        q[:, start : start + 4] = parts / np.linalg.norm(parts, axis=1)[:, np.newaxis]
    return np.array(np.broadcast_to(q, (1 if count is None else count, q.shape[1])))
