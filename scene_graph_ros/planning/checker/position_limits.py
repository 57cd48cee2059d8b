"""Which positions are beyond the limits of their joints."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.robots.kinematic_tree import KinematicTree
from scene_graph_ros.trajectories.limit_rounding import LIMIT_ROUNDING

__all__ = ["beyond_limits", "describe_excess", "moved_inside"]


def beyond_limits(
    tree: KinematicTree, q: NDArray[np.float64], moves: NDArray[np.bool_] | None = None
) -> NDArray[np.bool_]:
    """Tell of each entry of configurations ``(..., nq)`` whether it is beyond its limits.

    Only of those in ``moves`` ``(nq,)``, where that is given: any other stays where it
    was measured.
    """
    result: NDArray[np.bool_] = q < tree.lower - LIMIT_ROUNDING
    result |= q > tree.upper + LIMIT_ROUNDING
    return result if moves is None else result & moves


def moved_inside(
    tree: KinematicTree, q: NDArray[np.float64], moves: NDArray[np.bool_], tolerance: float
) -> NDArray[np.float64]:
    """Return a configuration ``(nq,)``, clipped where it is beyond a limit by so little.

    ``tolerance`` is in rad or m. Positions beyond by more stay, and so do those that do not move.
    """
    inside = np.clip(q, tree.lower, tree.upper)
    is_near = moves & (np.abs(inside - q) <= tolerance)
    return np.where(is_near, inside, q)


def describe_excess(
    tree: KinematicTree, q: NDArray[np.float64], moves: NDArray[np.bool_] | None = None
) -> str | None:
    """Return a sentence on the position of a configuration ``(nq,)`` beyond its limits.

    ``moves`` is as of `beyond_limits`.
    """
    outside = np.flatnonzero(beyond_limits(tree, q, moves))
    if not len(outside):
        return None
    i = outside[0]
    limits = f"[{tree.lower[i]:.10g}, {tree.upper[i]:.10g}]"
    return f"is beyond the limits {limits} of {tree.position_names[i]!r}: {q[i]:.10g}"
