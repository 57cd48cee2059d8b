"""Clouds of a sensor: which points are the robot's, and what their rays see through."""

import numpy as np
import pytest

from scene_graph_ros.geometry import GeometryInstance, ProximityProperties, SceneGraph, Sphere
from scene_graph_ros.geometry.perception import CameraIntrinsics
from scene_graph_ros.geometry.spatial.poses import pose_from_xyz_rpy
from scene_graph_ros.geometry.spatial.sums import moved
from scene_graph_ros.sensing import CloudView, DepthRules, DepthView, SeenPoints, SelfFilter
from scene_graph_ros.sensing.depth_kernels import CLEARED, EDGE, KEPT, SEEN_AGAIN
from scene_graph_ros.sensing.near_cells import OPEN, ROBOT

X_WS = pose_from_xyz_rpy([0.3, -1.0, 2.0], [2.5, 0.2, 0.7])
RULES = DepthRules(near=0.1, far=8.0, margin=0.02, error=0.01)
NAMES = {KEPT: "kept", CLEARED: "cleared", SEEN_AGAIN: "seen again"}


def sphere_rays(rng, count):
    """Return directions ``(count, 3)`` all around."""
    rays = rng.normal(size=(count, 3))
    return rays / np.linalg.norm(rays, axis=1)[:, np.newaxis]


def verdict(c, r, p_SPs, mask, rules):
    """Return what a ball's rays say, each ray for itself: the definition."""
    away = np.linalg.norm(c)
    lengths = np.linalg.norm(p_SPs, axis=1)
    is_ray = lengths >= rules.near
    rays = p_SPs[is_ray] / lengths[is_ray, np.newaxis]
    along = rays @ c
    off = np.linalg.norm(np.cross(rays, c), axis=1)
    goes_through = (along > 0.0) & (off <= r)
    if not rules.near <= away <= rules.far or not goes_through.any():
        return KEPT
    ends, shown = lengths[is_ray] - along, mask[is_ray]
    nearest = np.argmin(np.where(goes_through, off, np.inf))
    slack = r + rules.margin
    if shown[nearest] == EDGE:
        return KEPT
    if shown[nearest] == OPEN and abs(ends[nearest]) <= slack:
        return SEEN_AGAIN
    beyond = np.minimum(lengths[is_ray], rules.far) - along > slack
    return CLEARED if beyond[goes_through].all() else KEPT


@pytest.mark.parametrize("spread", ["around", "narrow", "line", "clusters", "one"])
def test_each_verdict_is_that_of_the_rays_through_the_ball(spread):
    """By brute force, for balls of one and of many rays; near seams of the faces, too."""
    rng = np.random.default_rng(3)
    rays = sphere_rays(rng, 1 if spread == "one" else 4000)
    if spread == "narrow":
        rays = rays * 0.3 + [0.7, 0.7, 0.7]
    elif spread == "line":
        rays[:, 2] = 0.0
    elif spread == "clusters":
        rays = np.where(rays[:, :1] > 0.0, [1.0, 0.0, 0.0], [0.0, -1.0, 1.0]) + 0.01 * rays
    rays /= np.linalg.norm(rays, axis=1)[:, np.newaxis]
    p_SPs = rays * rng.uniform(0.05, 9.0, (len(rays), 1))
    view = CloudView.of(p_SPs, X_WS, RULES)
    view.mask[:] = rng.choice([OPEN, ROBOT, EDGE], len(rays), p=[0.8, 0.1, 0.1])
    hidden = rays[rng.integers(0, len(rays), 500)] + 0.01 * rng.normal(size=(500, 3))
    balls = np.concatenate([hidden, sphere_rays(rng, 200)])
    balls *= rng.uniform(0.05, 9.0, (len(balls), 1))
    radii = rng.choice([0.0, 2e-4, 0.01, 0.05], len(balls)) * np.linalg.norm(balls, axis=1)
    radii = np.minimum(radii, 7.0 * view.grid.edge * np.linalg.norm(balls, axis=1))
    got = view.judge(moved(balls, X_WS), radii)
    again = moved(moved(balls, X_WS), np.linalg.inv(X_WS))
    expected = [verdict(c, r, p_SPs, view.mask, RULES) for c, r in zip(again, radii, strict=True)]
    np.testing.assert_array_equal(got, expected)
    if spread not in ("one", "line"):
        assert set(got) == set(NAMES)


def test_a_wall_that_steps_back_clears_and_one_that_stays_is_seen_again():
    """A cloud of a camera sees what its image of depth would."""
    lens = CameraIntrinsics(64, 48, 50.0, 60.0, 30.0, 20.5)
    rules = DepthRules(step=1, error=0.01)
    walls = [DepthView.of(np.full((48, 64), z, np.float32), lens, X_WS, rules) for z in (1, 1.5)]
    clouds = [CloudView.of(view.p_CPs.reshape(-1, 3), X_WS, rules) for view in walls]
    seen, counts = SeenPoints.none().after(clouds[0], clouds[0].points(), 1, 10_000)
    assert counts.new == 48 * 64
    same, counts = seen.after(clouds[0], clouds[0].points(), 2, 10_000)
    assert (len(same), counts.seen_again, counts.cleared) == (48 * 64, 48 * 64, 0)
    gone, counts = seen.after(clouds[1], clouds[1].points(), 2, 10_000)
    assert (len(gone), counts.seen_again, counts.cleared) == (48 * 64, 0, 48 * 64)


def ball_in_front(distance):
    """Return the filter of a ball of 0.1 m on the axis x of S."""
    graph = SceneGraph()
    source = graph.register_source("robot")
    X_SG = np.eye(4)
    X_SG[0, 3] = distance
    ball = GeometryInstance(X_WS @ X_SG, Sphere(0.1), "ball")
    ball.set_proximity_properties(ProximityProperties())
    own = SelfFilter(graph.model_inspector(), [graph.register_anchored_geometry(source, ball)])
    own.place({graph.world_frame_id(): np.eye(4)})
    return own


def cloud_of_a_ball(distance, wall, edge=0.02, size=61):
    """Return rows and columns of points: a ball, and a wall behind it."""
    s, t = np.meshgrid(np.arange(size) - size // 2, np.arange(size) - size // 2)
    rays = np.stack([np.ones(s.shape), edge * s, edge * t], -1).reshape(-1, 3)
    unit = rays / np.linalg.norm(rays, axis=1)[:, np.newaxis]
    along = unit[:, 0] * distance
    root = along**2 - distance**2 + 0.1**2
    hits = np.where(root > 0.0, along - np.sqrt(np.maximum(root, 0.0)), wall / unit[:, 0])
    return unit * hits[:, np.newaxis], (root > 0.0), (size, size)


@pytest.mark.parametrize("is_organized", [True, False])
def test_the_robot_and_its_edge_are_no_points(is_organized):
    """All that is on the ball, and all rays that pass within two of its outermost ones."""
    p_SPs, is_ball, size = cloud_of_a_ball(0.6, 2.0)
    size = size if is_organized else (1, len(p_SPs))
    rules = DepthRules(padding=0.01, shadow=2)
    view = CloudView.of(p_SPs, X_WS, rules, ball_in_front(0.6), size=size)
    np.testing.assert_array_equal(view.mask == ROBOT, is_ball)
    rows, columns = np.divmod(np.arange(len(p_SPs)), 61)
    near = np.stack([rows[is_ball], columns[is_ball]], 1)
    steps = np.abs(np.stack([rows, columns], 1)[:, None] - near[None])
    beside = steps.max(axis=2).min(axis=1) if is_organized else np.hypot(*steps.T).min(axis=0)
    is_edge = view.mask == EDGE
    if is_organized:
        np.testing.assert_array_equal(is_edge, (beside <= 2) & ~is_ball)
    else:
        # The cells are about as wide as the rays lie apart.
        assert is_edge[(beside <= 1.5) & ~is_ball].all()
        assert not is_edge[beside > 4.0].any()
    assert len(view.points().radii) == (view.mask == OPEN).sum()


def test_range_and_region_cut_and_the_radius_is_the_error():
    """Points too near or too far, outside of the region, or none at all."""
    p_SPs = np.array([[0.05, 0, 0], [0, 1.0, 0], [0, 0, 9.0], [-2.0, 0, 0]])
    found = CloudView.of(p_SPs, X_WS, RULES).points()
    np.testing.assert_allclose(found.p_WPs, moved(p_SPs[[1, 3]], X_WS), atol=1e-12)
    assert found.radii.tolist() == [0.01, 0.01]
    low = tuple(moved(p_SPs[[1]], X_WS)[0] - 0.1)
    high = tuple(moved(p_SPs[[1]], X_WS)[0] + 0.1)
    found = CloudView.of(p_SPs, X_WS, RULES._replace(lower=low, upper=high)).points()
    assert len(found.radii) == 1
    none = CloudView.of(np.empty((0, 3)), X_WS, RULES, ball_in_front(0.6))
    assert len(none.points().radii) == 0
    assert none.judge(np.ones((2, 3)), np.ones(2)).tolist() == [KEPT, KEPT]


def test_sensors_keep_their_points_apart():
    """What replaces, expires or is older concerns the points of its own sensor, or none."""
    p_SPs = np.array([[1.0, 0, 0], [0, 1.0, 0]])
    view = CloudView.of(p_SPs, X_WS, RULES)
    seen, _ = SeenPoints.none().replaced(view.points(), 5, 100, sensor=1)
    both, counts = seen.replaced(view.points(), 6, 100, sensor=2)
    assert (counts.new, len(both)) == (2, 4)
    assert both.sensors.tolist() == [1, 1, 2, 2]
    assert both.replaced(view.points(), 7, 100, sensor=1)[0].stamps.tolist() == [6, 6, 7, 7]
    assert both.since(7, sensor=1).sensors.tolist() == [2, 2]
    later = CloudView.of(3.0 * p_SPs, X_WS, RULES)
    cleared, counts = both.after(later, later.points(), 5, 100, sensor=3)
    assert counts.cleared == 2
    assert cleared.stamps.tolist() == [6, 6, 5, 5]
