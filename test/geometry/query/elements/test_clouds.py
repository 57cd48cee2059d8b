"""Queries about clouds: the answers of the ball that decides, found by looking at all of them."""

import math

import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation
from searching import times

from scene_graph_ros.geometry import (
    GeometryFrame,
    GeometryInstance,
    PointCloud,
    ProximityProperties,
    QueryObject,
    SceneGraph,
    Sphere,
)
from scene_graph_ros.geometry.errors import EngineError, UnsupportedPairError

EXACT = 1e-12


def with_clouds(scene, *clouds):
    """Add clouds on frames of their own; return their frames and ids."""
    added = []
    for k, cloud in enumerate(clouds):
        frame = scene.graph.register_frame(scene.source, GeometryFrame(f"cloud_{k}"))
        instance = GeometryInstance(np.eye(4), cloud, f"cloud_{k}")
        instance.set_proximity_properties(ProximityProperties())
        added.append((frame, scene.graph.register_geometry(scene.source, frame, instance)))
    scene.context = scene.graph.create_default_context()
    scene.query = scene.graph.query_object(scene.context)
    return added


def moved(scene, rng, side=0.8):
    """Give every frame of the scene's source a random pose."""
    n = len(scene.context.frame_poses(scene.source))
    X = np.tile(np.eye(4), (n, 1, 1))
    X[:, :3, :3] = Rotation.random(n, rng=rng).as_matrix()
    X[:, :3, 3] = rng.uniform(-side / 2, side / 2, (n, 3))
    scene.context.set_frame_poses(scene.source, X)


def in_world(scene, geometry_id, points):
    """Return points of a cloud in W."""
    X = scene.context.snapshot.pose_in_world(geometry_id)
    return points @ X[:3, :3].T + X[:3, 3]


def ball_distances(scene, geometry_id, centers, radii):
    """Return the distances of balls to a shape, each measured as a sphere of its own."""
    graph = SceneGraph()
    source = graph.register_source("oracle")
    inspector, snapshot = scene.context.inspector(), scene.context.snapshot
    target = GeometryInstance(
        snapshot.pose_in_world(geometry_id), inspector.get_shape(geometry_id), "target"
    )
    target.set_proximity_properties(inspector.get_proximity_properties(geometry_id))
    target_id = graph.register_anchored_geometry(source, target)
    ids = []
    for k, (center, radius) in enumerate(zip(centers, radii, strict=True)):
        X = np.eye(4)
        X[:3, 3] = center
        ball = GeometryInstance(X, Sphere(radius), f"ball_{k}")
        ball.set_proximity_properties(ProximityProperties())
        ids.append(graph.register_anchored_geometry(source, ball))
    query = graph.query_object(graph.create_default_context())
    pair = query.compute_signed_distance_pair_closest_points
    return np.array([pair(target_id, each).distance for each in ids])


CLOUDS = {
    "even": lambda rng, n: (rng.uniform(-0.4, 0.4, (n, 3)), np.full(n, 0.01)),
    "points": lambda rng, n: (rng.uniform(-0.4, 0.4, (n, 3)), np.zeros(n)),
    "radii": lambda rng, n: (rng.uniform(-0.4, 0.4, (n, 3)), rng.uniform(0, 0.1, n)),
    "line": lambda rng, n: (np.outer(rng.uniform(-1, 1, n), [1, 2, -0.5]), np.full(n, 0.02)),
    "clusters": lambda rng, n: (
        rng.normal(0, 0.3, (4, 3))[np.arange(n) % 4] + 1e-9 * rng.normal(size=(n, 3)),
        np.full(n, 0.001),
    ),
    "one place": lambda rng, n: (np.tile([[0.1, 0.2, 0.3]], (n, 1)), np.full(n, 0.05)),
    "one far": lambda rng, n: (
        np.concatenate([rng.uniform(-0.3, 0.3, (n - 1, 3)), [[1e9, 0, 0]]]),
        np.full(n, 0.01),
    ),
}


@pytest.mark.search
@pytest.mark.parametrize("kind", CLOUDS)
def test_the_nearest_ball_decides_each_pair(make_scene, kind):
    """As far, or as deep, as that ball is as a sphere, which is among the answers by its index."""
    scene, rng = make_scene(copies=1), np.random.default_rng(7)
    points, radii = CLOUDS[kind](rng, 40)
    ((_, cloud),) = with_clouds(scene, PointCloud(points, radii))
    for _ in range(times(2)):
        moved(scene, rng)
        table = scene.query.compute_signed_distance_pairwise_closest_points(certificate=True)
        rows = [k for k in range(len(table)) if int(cloud) in (table.id_A[k], table.id_B[k])]
        assert len(rows) == len(scene.ids)
        centers = in_world(scene, cloud, points)
        for record in (table[k] for k in rows):
            is_A = record.id_A == cloud
            other = record.id_B if is_A else record.id_A
            expected = ball_distances(scene, other, centers, radii)
            element = record.element_A if is_A else record.element_B
            size = 1e9 if kind == "one far" else 1.0
            assert record.distance == pytest.approx(expected.min(), abs=EXACT * size)
            assert expected[element] == pytest.approx(expected.min(), abs=EXACT * size)
            assert (record.element_B if is_A else record.element_A) == -1
            assert record.gap <= EXACT * size


def test_answers_agree_with_each_other(make_scene):
    """Penetrations, distances, candidates and yes or no; and witnesses with the distance."""
    scene, rng = make_scene(copies=1), np.random.default_rng(3)
    ((_, one), (_, other)) = with_clouds(
        scene,
        PointCloud(rng.uniform(-0.3, 0.3, (300, 3)), 0.02),
        PointCloud(rng.uniform(-0.3, 0.3, (200, 3)), rng.uniform(0.0, 0.05, 200)),
    )
    pose = scene.context.snapshot.pose_in_world
    for side in (0.5, 1.5, 9.0):
        moved(scene, rng, side)
        pose = scene.context.snapshot.pose_in_world
        distances = scene.query.compute_signed_distance_pairwise_closest_points()
        deep = scene.query.compute_point_pair_penetration()
        candidates = scene.query.find_collision_candidates()
        assert scene.query.has_collisions() == (len(deep) > 0)
        keys = list(zip(distances.id_A.tolist(), distances.id_B.tolist(), strict=True))
        assert keys == sorted(keys)
        assert (int(one), int(other)) in keys
        touching = {key: d for key, d in zip(keys, distances.distance, strict=True) if d < 0.0}
        found = dict(
            zip(zip(deep.id_A.tolist(), deep.id_B.tolist(), strict=True), deep.depth, strict=True)
        )
        assert found.keys() == touching.keys()
        assert all(-found[key] == pytest.approx(touching[key], abs=EXACT) for key in found)
        near = set(zip(candidates.id_A.tolist(), candidates.id_B.tolist(), strict=True))
        assert touching.keys() <= near
        for record in distances:
            p_WCa = (pose(record.id_A) @ [*record.p_ACa, 1.0])[:3]
            p_WCb = (pose(record.id_B) @ [*record.p_BCb, 1.0])[:3]
            assert p_WCa - p_WCb == pytest.approx(record.distance * record.nhat_BA_W, abs=EXACT)
        for record in deep:
            apart = (record.p_WCb - record.p_WCa) @ record.nhat_BA_W
            assert apart == pytest.approx(record.depth, abs=EXACT)
        within = scene.query.compute_signed_distance_pairwise_closest_points(0.1)
        assert set(within.id_A[within.distance > 0.1]) == set()
        assert len(within) == (distances.distance <= 0.1).sum()


def test_two_clouds_are_as_near_as_their_nearest_balls(make_scene):
    """By comparing each with each."""
    scene, rng = make_scene(copies=1), np.random.default_rng(11)
    points = [rng.uniform(-0.5, 0.5, (n, 3)) for n in (70, 500)]
    radii = [np.full(70, 0.01), rng.uniform(0.0, 0.1, 500)]
    (_, one), (_, other) = with_clouds(
        scene, PointCloud(points[0], 0.01), PointCloud(points[1], radii[1])
    )
    for side in (0.1, 3.0):
        moved(scene, rng, side)
        record = scene.query.compute_signed_distance_pair_closest_points(other, one)
        p, q = in_world(scene, one, points[0]), in_world(scene, other, points[1])
        apart = np.linalg.norm(p[:, np.newaxis] - q, axis=2) - radii[0][:, np.newaxis] - radii[1]
        assert record.distance == pytest.approx(apart.min(), abs=EXACT)
        assert apart[record.element_A, record.element_B] == pytest.approx(apart.min(), abs=EXACT)


@pytest.mark.search
@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e9])
def test_points_are_as_far_as_a_k_d_tree_says(scale):
    """A hundred thousand balls of one radius, of all sizes and far from the origin."""
    rng, n = np.random.default_rng(2), times(20_000)
    points = scale * (rng.uniform(-1, 1, (n, 3)) ** 3 + [5.0, 0.0, -7.0])
    graph = SceneGraph()
    source = graph.register_source("camera")
    instance = GeometryInstance(np.eye(4), PointCloud(points, 0.01 * scale), "seen")
    instance.set_proximity_properties(ProximityProperties())
    graph.register_anchored_geometry(source, instance)
    query = QueryObject(graph.create_default_context())
    asked = points[:500] + 0.1 * scale * rng.normal(size=(500, 3))
    expected, nearest = cKDTree(points).query(asked)
    for threads in (1, 2):
        table = query.compute_signed_distance_to_points(asked, threads=threads)
        assert table.distance == pytest.approx(
            expected - 0.01 * scale, rel=EXACT, abs=EXACT * scale
        )
        assert table.element.tolist() == nearest.tolist()
    # A point at its centre has no single way out; beyond the threshold are no answers.
    (inside,) = query.compute_signed_distance_to_point(points[3])
    assert (inside.element, inside.is_grad_W_unique) == (3, False)
    assert inside.distance == -0.01 * scale
    assert not len(query.compute_signed_distance_to_point(points[3] + 100.0 * scale, scale))


def test_derivatives_are_those_of_small_motions(make_scene):
    """Of the distance, and of the witness on the cloud, which turns about the cloud's origin."""
    scene, rng = make_scene(copies=1, floor=False), np.random.default_rng(5)
    ((frame, cloud),) = with_clouds(scene, PointCloud(rng.uniform(-0.2, 0.2, (30, 3)), 0.05))
    moved(scene, rng, 1.5)
    ball, step = scene.ids[0], 1e-6

    def ask():
        return scene.query.compute_signed_distance_pair_closest_points(
            ball, cloud, derivatives=True
        )

    record = ask()
    X_WF = scene.context.frame_pose(frame)
    for axis in range(6):
        ends = []
        for sign in (1.0, -1.0):
            V = np.zeros(6)
            V[axis] = sign * step
            X = X_WF.copy()
            X[:3, :3] = Rotation.from_rotvec(V[:3]).as_matrix() @ X_WF[:3, :3]
            X[:3, 3] += V[3:]
            scene.context.set_frame_pose(scene.source, frame, X)
            other = ask()
            pose = scene.context.snapshot.pose_in_world(cloud)
            ends.append((other.distance, (pose @ [*other.p_BCb, 1.0])[:3]))
        scene.context.set_frame_pose(scene.source, frame, X_WF)
        (d1, p1), (d2, p2) = ends
        assert record.ddistance_dX_WB[axis] == pytest.approx((d1 - d2) / (2 * step), abs=1e-7)
        moved_by = (p1 - p2) / (2 * step)
        assert record.dp_WCb_dX_WB[:, axis] == pytest.approx(moved_by, abs=1e-7)


def test_far_from_the_origin_answers_are_the_same(make_scene):
    """A thousand kilometres away, where poses can be written exactly."""
    scene, rng = make_scene(copies=1, floor=False), np.random.default_rng(9)
    with_clouds(scene, PointCloud(rng.integers(-9, 9, (99, 3)) / 16.0, 1 / 64))
    moved(scene, rng)
    X = scene.context.frame_poses(scene.source)
    X[:, :3, 3] = np.round(64.0 * X[:, :3, 3]) / 64.0
    scene.context.set_frame_poses(scene.source, X)
    near = scene.query.compute_signed_distance_pairwise_closest_points()
    X[:, :3, 3] += 2.0**20
    scene.context.set_frame_poses(scene.source, X)
    far = scene.query.compute_signed_distance_pairwise_closest_points()
    of_cloud = near.element_A + near.element_B >= 0
    assert far.distance[of_cloud] == pytest.approx(near.distance[of_cloud], abs=EXACT)


def test_a_cloud_without_points_is_near_nothing(make_scene):
    """It is in no answer; who asks about it is told."""
    scene = make_scene(copies=1)
    ((_, cloud),) = with_clouds(scene, PointCloud([], 0.1))
    for table in (
        scene.query.compute_signed_distance_pairwise_closest_points(),
        scene.query.compute_point_pair_penetration(),
        scene.query.find_collision_candidates(),
    ):
        assert int(cloud) not in {*table.id_A, *table.id_B}
    assert int(cloud) not in scene.query.compute_signed_distance_to_point((0, 0, 0)).id_G
    with pytest.raises(UnsupportedPairError, match="test/cloud_0/cloud_0 has no points"):
        scene.query.compute_signed_distance_pair_closest_points(cloud, scene.ids[0])


def test_filters_keep_clouds_from_being_asked_about(make_scene):
    """As any geometry; the pair alone can be asked about all the same."""
    from scene_graph_ros.geometry import CollisionFilterDeclaration, GeometrySet

    scene = make_scene(copies=1)
    ((_, cloud),) = with_clouds(scene, PointCloud([[0, 0, 0]], 0.1))
    ball = scene.ids[0]
    scene.graph.collision_filter_manager(scene.context).apply(
        CollisionFilterDeclaration().exclude_between(GeometrySet(cloud), GeometrySet(ball))
    )
    pairs = scene.query.find_collision_candidates()
    found = set(zip(pairs.id_A.tolist(), pairs.id_B.tolist(), strict=True))
    assert (int(ball), int(cloud)) not in found
    assert (int(scene.ids[1]), int(cloud)) in found
    record = scene.query.compute_signed_distance_pair_closest_points(ball, cloud)
    assert record.distance == pytest.approx(-0.2, abs=EXACT)


def test_contact_surfaces_have_none_of_clouds(make_scene):
    """With the fallback they are points; without, a contact is refused as of other shapes."""
    scene = make_scene(copies=1, floor=False)
    ((_, cloud),) = with_clouds(scene, PointCloud([[0, 0, 0]], 0.1))
    surfaces, points = scene.query.compute_contact_surfaces_with_fallback()
    assert len(surfaces) == 0
    assert int(cloud) in {*points.id_A, *points.id_B}
    far = np.tile(np.eye(4), (len(scene.frames) + 1, 1, 1))
    far[1:-1, 0, 3] = np.arange(1, len(scene.frames)) * 9.0
    scene.context.set_frame_poses(scene.source, far)
    with pytest.raises(UnsupportedPairError, match=r"PointCloud 'cloud_0'.*many elements"):
        scene.query.compute_contact_surfaces()


def test_the_engine_without_clouds_says_so(make_scene):
    """FCL has octrees, which are no clouds."""
    scene = make_scene(copies=1)
    with_clouds(scene, PointCloud([[0, 0, 0]], 0.1))
    with pytest.raises(EngineError, match="has no point clouds"):
        scene.query.compute_point_pair_penetration(engine="fcl")


def test_scenes_without_clouds_have_no_elements(make_scene):
    """Their columns are -1, and no column more is among those of a table."""
    table = make_scene(copies=1).query.compute_signed_distance_pairwise_closest_points()
    assert "element_A" not in table.columns
    assert (table.element_A == -1).all()
    assert table[0].element_B == -1
    points = make_scene(copies=1).query.compute_signed_distance_to_point((0, 0, 0))
    assert (points.element == -1).all()
    assert not math.isnan(points.distance[0])
