"""Checks and proofs against clouds by brute force: closed forms of boxes and balls, in NumPy.

A small share here; `make search` looks at a million configurations and two thousand edges.
"""

import numpy as np
import pytest
from scipy.spatial import cKDTree
from searching import times
from small_arm import ARM

from scene_graph_ros.geometry import (
    CollisionFilterDeclaration,
    GeometryInstance,
    GeometrySet,
    PointCloud,
    ProximityProperties,
    SceneGraph,
)
from scene_graph_ros.planning import RobotDiagram, SceneGraphCollisionChecker
from scene_graph_ros.scene_files import load_urdf, register_robot

BOX, AT = np.array([0.25, 0.05, 0.04]), np.array([0.25, 0.0, 0.0])
"""Half the edges of each link's box, m, and its centre."""
BALLS = np.array([[0.1, 0.1, 0.1], [0.45, 0.0, -0.08]])
"""Centres of each link's balls."""
RADIUS = 0.06
SHAPES = f"""
  <link name="{{name}}">
    <collision><origin xyz="0.25 0 0"/><geometry><box size="0.5 0.1 0.08"/></geometry></collision>
    <collision><origin xyz="0.1 0.1 0.1"/>
      <geometry><sphere radius="{RADIUS}"/></geometry></collision>
    <collision><origin xyz="0.45 0 -0.08"/>
      <geometry><sphere radius="{RADIUS}"/></geometry></collision>
  </link>"""
LINKS = ("upper", "lower")
EDGE = 1e-9
"""m: nearer to touching than that either answer is right."""


class Cell:
    """An arm of boxes and balls that only meet the cloud around it."""

    def __init__(self, folder, points, radius):
        file = folder / "arm.urdf"
        links = ARM[: ARM.index('<link name="upper">')]
        joints = ARM[ARM.index('<joint name="shoulder"') :]
        file.write_text(links + "".join(SHAPES.format(name=name) for name in LINKS) + joints)
        model, graph = load_urdf(file), SceneGraph()
        self.frames = register_robot(model, graph, graph.register_source("arm"))
        instance = GeometryInstance(np.eye(4), PointCloud(points, radius), "seen")
        instance.set_proximity_properties(ProximityProperties())
        bodies = graph.model_inspector().get_all_geometry_ids()
        without = CollisionFilterDeclaration().exclude_within(GeometrySet(bodies))
        graph.collision_filter_manager().apply(without)
        graph.register_anchored_geometry(graph.register_source("camera"), instance)
        self.points, self.radius, self.tree = points, radius, model.kinematic_tree()
        robots = RobotDiagram(graph, graph.create_default_context(), self.tree, self.frames)
        self.checker = SceneGraphCollisionChecker(robots)

    def clearances(self, q, points=None):
        """Return the least distance of the arm and the balls, m, of each configuration."""
        points = self.points if points is None else points
        found = np.empty(len(q))
        for k, one in enumerate(q):
            found[k] = min(gaps(points, X_WL) for X_WL in self.tree.link_poses(one, list(LINKS)))
        return found - self.radius


def gaps(points, X_WL):
    """Return the least distance of points and a link's box and balls, below zero inside."""
    p_LPs = (points - X_WL[:3, 3]) @ X_WL[:3, :3]
    beyond = np.abs(p_LPs - AT) - BOX
    of_box = np.linalg.norm(np.maximum(beyond, 0.0), axis=1) + np.minimum(beyond.max(axis=1), 0.0)
    of_balls = [np.linalg.norm(p_LPs - center, axis=1).min() - RADIUS for center in BALLS]
    return min(of_box.min(), *of_balls)


def around(rng, count):
    """Return points around the arm: half of them in clusters, as sensors see surfaces."""
    points = rng.uniform(-1.3, 1.3, (count, 3)) * [1.0, 1.0, 0.4]
    centers = rng.uniform(-1.2, 1.2, (8, 3)) * [1.0, 1.0, 0.3]
    half = count // 2
    points[:half] = centers[rng.integers(0, 8, half)] + 0.05 * rng.normal(size=(half, 3))
    return points[np.linalg.norm(points[:, :2], axis=1) > 0.35]


@pytest.mark.search
@pytest.mark.parametrize("radius", [0.0, 0.002, 0.005, 0.01, 0.02])
def test_configurations_are_free_where_each_ball_is_clear(tmp_path, radius):
    """Of a thousand points; nothing free that collides, nothing colliding that is free."""
    rng = np.random.default_rng(int(1e4 * radius))
    near = around(rng, 4000)
    cell = Cell(tmp_path, near[np.abs(near[:, 2]) > 0.09][:1000], radius)
    count = times(4000) if times(1) > 1 else 800  # a million of all radii in a search
    q = rng.uniform(-2.0, 2.0, (count, 2))
    free = cell.checker.check_configs_collision_free(q, threads=2)
    clear = cell.clearances(q)
    decided = np.abs(clear) > EDGE
    np.testing.assert_array_equal(free[decided], clear[decided] > 0.0)
    assert 0.02 < free.mean() < 0.98


@pytest.mark.search
def test_edges_are_free_where_each_moment_is(tmp_path):
    """By samples, twenty thousand where they come nearer than 5 mm; what is clear is proven."""
    rng = np.random.default_rng(2)
    near = around(rng, 4000)
    cell = Cell(tmp_path, near[np.abs(near[:, 2]) > 0.1][:1000], 0.005)
    q = rng.uniform(-2.0, 2.0, (times(400), 2))
    count = times(40) if times(1) > 1 else 12  # two thousand in a search
    q = q[cell.checker.check_configs_collision_free(q)][:count]
    edges = np.stack([q, np.clip(q + rng.normal(0.0, 0.3, q.shape), -2.0, 2.0)], axis=1)
    free = cell.checker.check_edges_collision_free(edges)
    assert 0.05 < free.mean() < 0.95
    for is_free, (first, last) in zip(free, edges, strict=True):
        least = np.inf
        for samples in (200, min(20_000, times(400))):
            t = np.linspace(0.0, 1.0, samples)[:, np.newaxis]
            least = cell.clearances(first + t * (last - first)).min()
            if least > 0.005 or least < -EDGE:
                break
        assert not (is_free and least < -EDGE), (first, last, least)
        assert is_free or least < 1e-3, (first, last, least)


@pytest.mark.search
def test_many_points_are_those_of_a_tree_of_another(tmp_path):
    """A hundred thousand points: those near a link, by SciPy's k-d tree, decide."""
    rng = np.random.default_rng(6)
    points = around(rng, 100_000)
    points = points[np.abs(points[:, 2]) > 0.12]
    cell, tree = Cell(tmp_path, points, 0.005), cKDTree(points)
    q = rng.uniform(-2.0, 2.0, (times(100), 2))
    free = cell.checker.check_configs_collision_free(q)
    reach = np.linalg.norm(BOX) + 0.2
    for one, is_free in zip(q, free, strict=True):
        X_WLs = cell.tree.link_poses(one, list(LINKS))
        found = [tree.query_ball_point(X[:3, :3] @ AT + X[:3, 3], reach) for X in X_WLs]
        near = points[np.unique(np.concatenate(found).astype(np.int64))]
        clear = cell.clearances(one[np.newaxis], near)[0] if len(near) else np.inf
        assert abs(clear) <= EDGE or is_free == (clear > 0.0), (one, clear)
    assert 0.0 < free.mean() < 1.0
