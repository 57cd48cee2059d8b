"""Configurations on paths: evenly spread, ends included."""

import numpy as np

from scene_graph_ros.planning.paths.path_points import points_on
from scene_graph_ros.robots import KinematicTree
from scene_graph_ros.robots.tree_joint import TreeJoint
from scene_graph_ros.robots.tree_kernels import PRISMATIC

RAILS = KinematicTree(
    "rails",
    tuple(TreeJoint(name, PRISMATIC, i, np.eye(4)) for i, name in enumerate("xy")),
    ("link",),
    (2,),
    np.eye(4)[np.newaxis],
)


def test_points_are_evenly_spread_over_all_edges():
    """Edges of 3 m and 1 m: five points are a metre apart."""
    path = np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 1.0]])
    expected = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0], [3.0, 1.0]]
    np.testing.assert_allclose(points_on(RAILS, path, 5), expected, atol=1e-15)


def test_paths_that_stand_still():
    """One configuration, the same twice, and an edge of no length in a path."""
    here = np.array([[1.0, 2.0]])
    np.testing.assert_array_equal(points_on(RAILS, here, 3), np.repeat(here, 3, axis=0))
    twice = np.repeat(here, 2, axis=0)
    np.testing.assert_array_equal(points_on(RAILS, twice, 3), np.repeat(here, 3, axis=0))
    path = np.concatenate([twice, [[1.0, 4.0]]])
    np.testing.assert_allclose(points_on(RAILS, path, 3)[1], [1.0, 3.0], atol=1e-15)
