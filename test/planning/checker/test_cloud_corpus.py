"""Checks and proofs of a Panda against clouds by brute force: closed forms of hulls, in NumPy.

A small share here; `make search` looks at a million configurations and two thousand edges.
"""

from hull_gaps import HullBody
import numpy as np
import pytest
from robots import find_robot
from scipy.spatial import cKDTree
from searching import times

from benchmarks.clouds import points_on_faces
from scene_graph_ros.geometry import (
    Box,
    CollisionFilterDeclaration,
    GeometryInstance,
    GeometrySet,
    PointCloud,
    ProximityProperties,
    SceneGraph,
)
from scene_graph_ros.planning import RobotDiagram, SceneGraphCollisionChecker
from scene_graph_ros.scene_files import register_robot

EDGE = 1e-9
"""m: nearer to touching than that either answer is right."""
BRIEF = 1e-6
"""m: larger clearances are not measured where only touching matters."""
NEAR = 5e-3
"""m: edges that come nearer are sampled finely."""
LONGEST = 1.3
"""m: no point of the robot is farther from a joint's axis, so none moves more per radian."""
CORNERS = np.array([[a, b, c] for a in (-0.5, 0.5) for b in (-0.5, 0.5) for c in (-0.5, 0.5)])


class Cell:
    """A Panda whose bodies only meet the cloud around it."""

    def __init__(self, points, radius):
        model, semantics = find_robot("panda")
        graph = SceneGraph()
        arm = graph.register_source("panda")
        frames = register_robot(model, graph, arm, semantics=semantics, visual=False)
        inspector = graph.model_inspector()
        self.tree = model.kinematic_tree(semantics)
        self.links = list(frames)
        names = {frame: link for link, frame in frames.items()}
        self.bodies = []
        for each in inspector.get_geometries_for_source(arm):
            shape, hull = inspector.get_shape(each), inspector.get_convex_hull(each)
            vertices = hull.vertices if hull is not None else CORNERS * shape.size
            assert hull is not None or isinstance(shape, Box)
            X_LG = inspector.get_pose_in_frame(each)
            link = self.links.index(names[inspector.get_frame_id(each)])
            self.bodies.append((link, HullBody(vertices @ X_LG[:3, :3].T + X_LG[:3, 3])))
        instance = GeometryInstance(np.eye(4), PointCloud(points, radius), "seen")
        instance.set_proximity_properties(ProximityProperties())
        without = CollisionFilterDeclaration().exclude_within(
            GeometrySet(inspector.get_geometries_for_source(arm))
        )
        graph.collision_filter_manager().apply(without)
        graph.register_anchored_geometry(graph.register_source("camera"), instance)
        self.points, self.radius = points, radius
        robots = RobotDiagram(graph, graph.create_default_context(), self.tree, frames)
        self.checker = SceneGraphCollisionChecker(robots)

    def sample(self, rng, count):
        """Return configurations within the limits."""
        return self.tree.sample(rng, count)

    def near(self, q, reach, points, nearest=None):
        """Return (configuration, point, gap) of points nearer than ``reach`` to some body."""
        found = []
        for first in range(0, len(q), 200):
            X_WLs = self.tree.link_poses(q[first : first + 200], self.links)
            for link, body in self.bodies:
                rows, picked, gaps = body.near(X_WLs[:, link], points, reach, nearest)
                found.append((rows + first, picked, gaps))
        return tuple(np.concatenate(each) for each in zip(*found, strict=True))

    def clearances(self, q, reach=BRIEF, points=None, nearest=None):
        """Return the least distance of the robot and the balls, m, of each configuration.

        Those above ``reach`` are infinite.
        """
        points = self.points if points is None else points
        rows, _, gaps = self.near(q, self.radius + reach, points, nearest)
        least = np.full(len(q), np.inf)
        np.minimum.at(least, rows, gaps)
        return least - self.radius

    def least_clearance(self, first, last, samples):
        """Return the least distance on an edge, m, of so many samples; inf above NEAR.

        Those are left out that lie between two of 200 samples from which the robot can't have
        come as near as that.
        """
        steps = np.linspace(0.0, 1.0, 200)
        q = first + steps[:, np.newaxis] * (last - first)
        travel = LONGEST * np.abs(q[1] - q[0]).sum()
        # Farther points are not met between two samples.
        near = self.points[np.unique(self.near(q, self.radius + NEAR + travel, self.points)[1])]
        coarse = self.clearances(q, NEAR + travel, near)
        if coarse.min() < -EDGE:
            return coarse.min()
        t = np.linspace(0.0, 1.0, samples)
        before = np.minimum((199 * t).astype(int), 198)
        t = t[np.minimum(coarse[before], coarse[before + 1]) <= NEAR + 0.5 * travel]
        if not len(t):
            return np.inf
        fine = self.clearances(first + t[:, np.newaxis] * (last - first), NEAR, near)
        return min(fine.min(), coarse.min() if coarse.min() <= NEAR else np.inf)


def wall(count, seed=0):
    """Return points on furniture, and some in the air around the robot."""
    rng = np.random.default_rng(seed)
    air = rng.normal(size=(count // 20, 3))
    air *= rng.uniform(0.5, 0.9, (len(air), 1)) / np.linalg.norm(air, axis=1)[:, np.newaxis]
    air += [0.0, 0.0, 0.33]
    return np.concatenate([points_on_faces(count - len(air), seed), air])


@pytest.mark.search
@pytest.mark.parametrize("radius", [0.0, 0.002, 0.005, 0.01, 0.02])
def test_configurations_are_free_where_each_ball_is_clear(radius):
    """Of a thousand points; nothing free that collides, nothing colliding that is free."""
    rng = np.random.default_rng(int(1e4 * radius))
    cell = Cell(wall(1000, int(1e4 * radius)), radius)
    count = times(4000) if times(1) > 1 else 400  # a million of all radii in a search
    q = cell.sample(rng, count)
    free = cell.checker.check_configs_collision_free(q, threads=2)
    clear = cell.clearances(q)
    decided = np.abs(clear) > EDGE
    np.testing.assert_array_equal(free[decided], clear[decided] > 0.0)
    assert 0.02 < free.mean() < 0.98


@pytest.mark.search
def test_edges_are_free_where_each_moment_is():
    """By samples, twenty thousand where they come nearer than 5 mm; what is clear is proven."""
    rng = np.random.default_rng(2)
    cell = Cell(wall(1000), 0.005)
    q = cell.sample(rng, times(400))
    count = times(40) if times(1) > 1 else 12  # two thousand in a search
    q = q[cell.checker.check_configs_collision_free(q)][:count]
    ends = np.clip(q + rng.normal(0.0, 0.4, q.shape), cell.tree.lower, cell.tree.upper)
    edges = np.stack([q, ends], axis=1)
    free = cell.checker.check_edges_collision_free(edges)
    assert 0.05 < free.mean() < 0.95
    for is_free, (first, last) in zip(free, edges, strict=True):
        least = cell.least_clearance(first, last, min(20_000, times(400)))
        assert not (is_free and least < -EDGE), (first, last, least)
        assert is_free or least < 1e-3, (first, last, least)


@pytest.mark.search
def test_many_points_are_those_of_a_tree_of_another():
    """A hundred thousand points: those near a link, by SciPy's k-d tree, decide."""
    rng = np.random.default_rng(6)
    points = wall(100_000, 6)
    cell, tree = Cell(points, 0.005), cKDTree(points)

    def nearest(center, radius):
        return np.array(tree.query_ball_point(center, radius), np.int64)

    q = cell.sample(rng, times(60))
    free = cell.checker.check_configs_collision_free(q)
    clear = cell.clearances(q, nearest=nearest)
    decided = np.abs(clear) > EDGE
    np.testing.assert_array_equal(free[decided], clear[decided] > 0.0)
    assert 0.02 < free.mean() < 0.98
