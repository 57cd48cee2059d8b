"""Checks and proofs against clouds: nothing free that collides, nothing colliding that is free.

A small share here; `make search` looks at a million configurations.
"""

import numpy as np
import pytest
from searching import times
from sensed_cell import SensedCell

from scene_graph_ros.geometry import (
    CollisionFilterDeclaration,
    GeometryFrame,
    GeometryInstance,
    GeometrySet,
    PointCloud,
    ProximityProperties,
    QueryObject,
    Sphere,
)
from scene_graph_ros.planning import EdgeStatus, SceneGraphCollisionChecker
from scene_graph_ros.planning.checker.carried_checker import pack
from scene_graph_ros.planning.checker.configuration_checks import first_of_all
from scene_graph_ros.planning.edges import cloud_proofs
from scene_graph_ros.planning.pairs.check_kernels import NO_PAIR


def at(center):
    """Return a pose without a rotation."""
    X = np.eye(4)
    X[:3, 3] = center
    return X


class Cell(SensedCell):
    """An arm with a cloud around it, and the same with each ball as a geometry."""

    def __init__(self, tmp_path, points, radii, *, padding=0.0, as_spheres=False):
        super().__init__(tmp_path)
        shapes = [PointCloud([], radii.max(initial=0.01))]
        if as_spheres:
            shapes = [Sphere(r) for r in radii]
        self.ids = [
            self.add(shape, at(points[k] if as_spheres else np.zeros(3)), f"ball_{k}")
            for k, shape in enumerate(shapes)
        ]
        self.context = self.graph.create_default_context()
        if not as_spheres:
            self.set(points, radii)
        self.checker = self.new_checker(padding)

    def set(self, points, radii):
        """Give the cloud these balls."""
        one = radii.size == 0 or (radii == self.context.inspector().get_shape(self.ids[0]).radius)
        value = points if np.all(one) else (points, radii)
        self.context.set_points(self.sensor, {self.ids[0]: value})


def ring(rng, n, radius):
    """Return balls on a wall around an arm, with gaps; all of one radius, or each of its own."""
    angle = rng.uniform(-np.pi, np.pi, n)
    out = rng.uniform(0.3, 1.3, n)
    z = rng.uniform(-0.4, 0.4, n)
    radii = np.full(n, radius) if radius else rng.uniform(0.0, 0.03, n)
    return np.column_stack([out * np.cos(angle), out * np.sin(angle), z]), radii


@pytest.mark.search
@pytest.mark.parametrize("radius", [0.01, 0.0])
@pytest.mark.parametrize("padding", [0.0, 0.03])
def test_configurations_collide_where_they_do_with_each_ball(tmp_path, radius, padding):
    """A cloud is as good as its balls, in every answer about configurations."""
    rng = np.random.default_rng(4)
    points, radii = ring(rng, 150, radius)
    cloud = Cell(tmp_path, points, radii, padding=padding)
    balls = Cell(tmp_path, points, radii, padding=padding, as_spheres=True)
    q = rng.uniform(-2.0, 2.0, (times(2000), 2))
    free = cloud.checker.check_configs_collision_free(q, threads=2)
    assert (free == balls.checker.check_configs_collision_free(q)).all()
    assert 0.05 < free.mean() < 0.95
    found = cloud.checker.find_collisions(q[:200])
    of_all = first_of_all(cloud.checker.plan, q[:200], 1)
    plan = cloud.checker.plan
    assert [plan.ids(p) for p in of_all[of_all != NO_PAIR]] == list(found.pairs)
    depths = balls.checker.find_collisions(q[:200])
    assert found.rows.tolist() == depths.rows.tolist()
    assert (found.depths > -1e-15).all()


@pytest.mark.parametrize("radius", [0.04, 0.0])
def test_overlaps_may_be_as_deep_as_a_negative_padding(tmp_path, radius):
    """As deep as the ball that is deepest, which the scene's own query tells."""
    rng = np.random.default_rng(9)
    points, radii = ring(rng, 40, radius)
    radii = radii if radius else np.zeros(len(radii))
    cell = Cell(tmp_path, points, radii)
    arm = cell.context.inspector().get_source_id_by_name("arm")
    q = rng.uniform(-2.0, 2.0, (40, 2))
    allowed = SceneGraphCollisionChecker(
        cell.robots, env_collision_padding=-0.03, self_collision_padding=-1.0
    ).check_configs_collision_free(q)
    for row, is_allowed in zip(q, allowed, strict=True):
        links = cell.robots.tree.link_poses(row, ["upper", "lower"])
        X_PF = {cell.frames["upper"]: links[0], cell.frames["lower"]: links[1]}
        for name, X in zip(("upper", "lower"), links, strict=True):
            parent = cell.context.inspector().get_parent_frame(cell.frames[name])
            X_WP = next((X_PF[f] for f in X_PF if f == parent), np.eye(4))
            cell.context.set_frame_pose(arm, cell.frames[name], np.linalg.inv(X_WP) @ X)
        deep = QueryObject(cell.context).compute_point_pair_penetration()
        of_cloud = (deep.element_A >= 0) | (deep.element_B >= 0)
        assert is_allowed == (deep.depth[of_cloud].max(initial=0.0) <= 0.03)
    assert allowed.any()
    assert not allowed.all()


@pytest.mark.search
def test_edges_are_proven_where_they_are_with_each_ball(tmp_path, monkeypatch):
    """Quickly, pair by pair, and by how much; and no sample of a proven one collides."""
    rng = np.random.default_rng(8)
    points, radii = ring(rng, 60, 0.02)
    cloud, balls = (Cell(tmp_path, points, radii, as_spheres=s) for s in (False, True))
    q = rng.uniform(-2.0, 2.0, (times(600), 2))
    q = q[cloud.checker.check_configs_collision_free(q)]
    edges = np.stack([q, np.clip(q + rng.normal(0.0, 0.4, q.shape), -2.0, 2.0)], axis=1)
    statuses = cloud.checker.edge_statuses(edges)
    assert (statuses == balls.checker.edge_statuses(edges)).all()
    free = statuses == EdgeStatus.FREE.value
    assert 0.2 < free.mean() < 0.9
    t = np.linspace(0.0, 1.0, 2000)[:, np.newaxis]
    for q1, q2 in edges[free][:20]:
        assert cloud.checker.check_configs_collision_free(q1 + t * (q2 - q1)).all()
    measures = cloud.checker.measure_edges(edges[:60])
    for mine, theirs in zip(measures, balls.checker.measure_edges(edges[:60]), strict=True):
        assert mine.status is theirs.status
        if mine.status is EdgeStatus.COLLIDES:
            assert not balls.checker.check_config_collision_free(mine.configuration)
    monkeypatch.setattr(cloud_proofs, "split_of", lambda plan: None)
    assert (cloud.checker.edge_statuses(edges) == statuses).all()


def test_a_checker_at_another_moment_has_its_points(tmp_path):
    """Those that were set meanwhile, no points at all, and as many as there were."""
    rng = np.random.default_rng(2)
    points, radii = ring(rng, 100, 0.02)
    cell = Cell(tmp_path, points, radii)
    q = rng.uniform(-2.0, 2.0, (300, 2))
    before = cell.checker.check_configs_collision_free(q)
    cell.context.set_points(cell.sensor, {cell.ids[0]: points[::2]})
    other = cell.checker.at(cell.context.snapshot)
    fresh = SceneGraphCollisionChecker(cell.robots)
    after = other.check_configs_collision_free(q)
    assert (after == fresh.check_configs_collision_free(q)).all()
    assert (after | ~before).all()
    assert after.sum() > before.sum()
    cell.context.set_points(cell.sensor, {cell.ids[0]: []})
    alone = Cell(tmp_path, points[:0], radii[:0]).checker.check_configs_collision_free(q)
    none = cell.checker.at(cell.context.snapshot).check_configs_collision_free(q)
    assert (none == alone).all()
    assert (cell.checker.check_configs_collision_free(q) == before).all()


def test_clearances_are_distances_of_the_nearest_ball(tmp_path):
    """With their derivatives, which move configurations away from it."""
    rng = np.random.default_rng(6)
    points, radii = ring(rng, 80, 0.02)
    cloud, balls = (Cell(tmp_path, points, radii, as_spheres=s) for s in (False, True))
    q = rng.uniform(-2.0, 2.0, (50, 2))
    q = q[cloud.checker.check_configs_collision_free(q)]
    step = 1e-6
    for row in q[:8]:
        own, theirs = (cell.checker.calc_robot_clearance(row, 0.3) for cell in (cloud, balls))
        assert len(own.distances) <= len(theirs.distances)
        assert own.distances.min() == pytest.approx(theirs.distances.min(), abs=1e-12)
        for k in range(2):
            moved = np.zeros(2)
            moved[k] = step
            ends = [
                cloud.checker.calc_robot_clearance(row + s * moved, 0.4).distances.min()
                for s in (1, -1)
            ]
            nearest = int(own.distances.argmin())
            slope = (ends[0] - ends[1]) / (2 * step)
            assert own.jacobians[nearest, k] == pytest.approx(slope, abs=1e-5)


def test_filters_added_shapes_and_other_processes(tmp_path):
    """A cloud is filtered, added and sent to other processes like any geometry."""
    rng = np.random.default_rng(3)
    points, radii = ring(rng, 100, 0.03)
    cell = Cell(tmp_path, points, radii)
    q = rng.uniform(-2.0, 2.0, (200, 2))
    free = cell.checker.check_configs_collision_free(q)
    carried = pack(cell.checker).unpacked()
    assert (carried.check_configs_collision_free(q) == free).all()
    edges = np.stack([q, q + 0.1], axis=1)
    assert (
        carried.check_edges_collision_free(edges) == cell.checker.check_edges_collision_free(edges)
    ).all()
    alone = Cell(tmp_path, points[:0], radii[:0]).checker.check_configs_collision_free(q)
    arm = [i for i in cell.context.inspector().get_all_geometry_ids() if i not in cell.ids]
    cell.graph.collision_filter_manager(cell.context).apply(
        CollisionFilterDeclaration().exclude_between(GeometrySet(arm), GeometrySet(cell.ids[0]))
    )
    filtered = SceneGraphCollisionChecker(cell.robots)
    assert (filtered.check_configs_collision_free(q) == alone).all()
    assert alone.sum() > free.sum()


def test_a_held_cloud_is_checked_as_what_is_held(tmp_path):
    """A cloud on a robot's link moves with it, and touches what stands still."""
    rng = np.random.default_rng(5)
    points, radii = ring(rng, 40, 0.02)
    cell = Cell(tmp_path, points, radii)
    arm = cell.context.inspector().get_source_id_by_name("arm")
    held = GeometryFrame("held")
    frame = cell.graph.register_frame(arm, held, parent=cell.frames["lower"], context=cell.context)
    thing = np.array([[0.6, 0.0, 0.0], [0.7, 0.0, 0.1]])
    instance = GeometryInstance(np.eye(4), PointCloud(thing, 0.05), "thing")
    instance.set_proximity_properties(ProximityProperties())
    cell.graph.register_geometry(arm, frame, instance, context=cell.context)
    checker = SceneGraphCollisionChecker(cell.robots)
    tree = cell.robots.tree
    q = rng.uniform(-2.0, 2.0, (300, 2))
    X_WL = np.array([tree.link_poses(each, ["lower"])[0] for each in q])
    p_WT = np.einsum("nij,kj->nki", X_WL[:, :3, :3], thing) + X_WL[:, np.newaxis, :3, 3]
    apart = np.linalg.norm(p_WT[:, :, np.newaxis] - points, axis=3).min(axis=(1, 2)) - 0.05 - 0.02
    alone = cell.checker.check_configs_collision_free(q)
    free = checker.check_configs_collision_free(q)
    assert not free[apart < 0.0].any()
    assert (free <= alone).all()
    assert (alone & (apart < 0.0)).any()
