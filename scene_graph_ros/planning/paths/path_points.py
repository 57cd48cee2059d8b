"""Configurations on a path, to look at it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.robots.kinematic_tree import KinematicTree

__all__ = ["points_on"]


def points_on(tree: KinematicTree, path: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """Return ``(count, nq)`` configurations, evenly spread over a path ``(n, nq)``, ends included.

    The path's length is that of straight lines between its configurations, rad and m alike.
    """
    steps = np.linalg.norm(np.diff(path, axis=0), axis=1)
    lengths = np.concatenate([[0.0], steps.cumsum()])
    if lengths[-1] == 0.0:
        return np.repeat(path[:1], count, axis=0)
    points = np.empty((count, path.shape[1]))
    for row, along in enumerate(np.linspace(0.0, lengths[-1], count)):
        i = min(int(np.searchsorted(lengths, along, side="right")) - 1, len(path) - 2)
        t = (along - lengths[i]) / steps[i] if steps[i] > 0.0 else 0.0
        points[row] = tree.interpolate(path[i], path[i + 1], min(t, 1.0))
    return points
