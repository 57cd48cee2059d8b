"""Signed distances of points from one mesh."""

import numpy as np

from scene_graph_ros.geometry.query.point.batch import distance_points
from scene_graph_ros.geometry.tables.shape_table import build_shape_table

__all__ = ["signed_distances"]


def signed_distances(mesh, points):
    """Return the signed distances of (n, 3) points from a mesh, in its frame."""
    table = build_shape_table([mesh], [True])
    return distance_points(table, np.eye(4)[None].copy(), points, np.inf)[2]
