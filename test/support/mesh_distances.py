"""Signed distances of points and balls from one mesh."""

import numpy as np

from scene_graph_ros.geometry import Sphere
from scene_graph_ros.geometry.query.distance.driver import solve_pairs, WITHIN
from scene_graph_ros.geometry.query.point.batch import distance_points
from scene_graph_ros.geometry.tables.held_table import hold
from scene_graph_ros.geometry.tables.shape_table import build_shape_table

__all__ = ["ball_distances", "signed_distances"]


def signed_distances(mesh, points):
    """Return the signed distances of (n, 3) points from a mesh, in its frame."""
    table = build_shape_table([mesh], [True])
    return distance_points(table, np.eye(4)[None].copy(), points, np.inf)[2]


def ball_distances(mesh, centres, radii):
    """Return the signed distances of balls with (n, 3) centres from a mesh, by its triangles."""
    balls = [Sphere(float(r)) for r in radii]
    table = build_shape_table([mesh, *balls], [True] + [False] * len(balls))
    X_WG = np.tile(np.eye(4), (len(balls) + 1, 1, 1))
    X_WG[1:, :3, 3] = centres
    pairs = np.column_stack([np.zeros(len(balls), dtype=np.int64), np.arange(1, len(balls) + 1)])
    return solve_pairs(hold(table), X_WG, pairs, np.inf, WITHIN).distance
