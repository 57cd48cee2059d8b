"""Which positions are beyond the limits of their joints."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.robots.kinematic_tree import KinematicTree
from scene_graph_ros.trajectories.limit_rounding import LIMIT_ROUNDING

__all__ = ["beyond_limits", "describe_excess"]


def beyond_limits(tree: KinematicTree, q: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Tell of each entry of configurations ``(..., nq)`` whether it is beyond its limits."""
    result: NDArray[np.bool_] = q < tree.lower - LIMIT_ROUNDING
    return result | (q > tree.upper + LIMIT_ROUNDING)


def describe_excess(tree: KinematicTree, q: NDArray[np.float64]) -> str | None:
    """Return which position of a configuration ``(nq,)`` is beyond its limits, in words."""
    outside = np.flatnonzero(beyond_limits(tree, q))
    if not len(outside):
        return None
    i = outside[0]
    limits = f"[{tree.lower[i]:.10g}, {tree.upper[i]:.10g}]"
    return f"is beyond the limits {limits} of {tree.position_names[i]!r}: {q[i]:.10g}"
