"""Edges by control points, outside of kernels; see ``curve_kernels``."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.robots.kinematic_tree import KinematicTree
from scene_graph_ros.robots.tree_kernels import FLOATING

__all__ = ["point_on_curve", "turning_quaternions"]


def point_on_curve(
    tree: KinematicTree, edge: NDArray[np.float64], t: float
) -> NDArray[np.float64]:
    """Return the configuration ``(nq,)`` at t in [0, 1] on an edge ``(m, nq)``.

    A straight one is `KinematicTree.interpolate`'s, others are Bézier curves (de Casteljau).
    """
    if len(edge) == 2:
        return tree.interpolate(edge[0], edge[1], t)
    points = edge
    while len(points) > 1:
        points = (1.0 - t) * points[:-1] + t * points[1:]
    return points[0]


def turning_quaternions(
    tree: KinematicTree, edges: NDArray[np.float64]
) -> Iterator[tuple[int, str]]:
    """Yield the row of edges ``(n, m, nq)`` along which a floating joint turns, and its name."""
    for joint, start in zip(tree.joints, tree.table.starts[1:], strict=True):
        if joint.kind == FLOATING:
            turns = np.ptp(edges[:, :, start : start + 4], axis=1).any(axis=1)
            for row in np.flatnonzero(turns):
                yield int(row), joint.name
