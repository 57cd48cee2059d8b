"""Clouds as convex sets: their balls, or where these are many, boxes around eight neighbours."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.convex.sets.convex_set import ConvexSet
from scene_graph_ros.convex.sets.hyperellipsoid import Hyperellipsoid
from scene_graph_ros.convex.sets.point import Point
from scene_graph_ros.convex.sets.v_polytope import VPolytope
from scene_graph_ros.geometry.model.point_set import PointSet

__all__ = ["MOST_BALLS", "sets_of_cloud"]

MOST_BALLS = 1000
"""A cloud of more is taken by boxes, of which each holds eight balls that are neighbours."""


def sets_of_cloud(points: PointSet, X_FG: NDArray[np.float64]) -> list[ConvexSet]:
    """Return sets that hold all balls of a cloud at ``X_FG`` ``(4, 4)``, in F."""
    R, p = X_FG[:3, :3], X_FG[:3, 3]
    if points.count > MOST_BALLS:
        return [VPolytope(corners @ R.T + p) for corners in _boxes(points)]
    centers = points.points @ R.T + p
    radii = np.broadcast_to(points.radii, len(centers)).tolist()
    return [
        Hyperellipsoid(np.eye(3) / radius, center) if radius > 0.0 else Point(center)
        for center, radius in zip(centers, radii, strict=True)
    ]


def _boxes(points: PointSet) -> NDArray[np.float64]:
    """Return the corners ``(m, 8, 3)`` in G of boxes around the leaves of the points' tree."""
    tree = points.placed.tree
    radii = tree.radii[:, np.newaxis] if len(tree.radii) else tree.radius[1]
    lower = (tree.points - radii).min(axis=2)
    upper = (tree.points + radii).max(axis=2)
    sides = np.array(list(itertools.product((0, 1), repeat=3)), dtype=np.bool_)
    return np.where(sides, upper[:, np.newaxis], lower[:, np.newaxis])
