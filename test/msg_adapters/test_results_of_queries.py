"""Results of real queries as messages: the adapters read the columns that queries make."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from msg_adapters import queries
from msg_adapters.contacts import contacts_to_msg
from msg_adapters.names import SceneNames
from scene_graph_ros import geometry as core
from scene_graph_ros.geometry.spatial.poses import pose_from_xyz_rpy


@pytest.fixture
def balls() -> SimpleNamespace:
    """Make balls of radius 1 and 2 on frames 2.5 m apart along z, turned, and a far one."""
    graph = core.SceneGraph()
    source = graph.register_source("s")
    frames, ids = [], []
    for name, radius in (("small", 1.0), ("large", 2.0), ("far", 0.5)):
        frames.append(graph.register_frame(source, core.GeometryFrame(name)))
        instance = core.GeometryInstance(np.eye(4), core.Sphere(radius), f"{name}_ball")
        ids.append(graph.register_geometry(source, frames[-1], instance))
        graph.assign_role(source, ids[-1], core.ProximityProperties())
    context = graph.create_default_context()
    # Turned half around z: x and y of the witnesses change signs in the geometries' frames.
    X_WF = [
        pose_from_xyz_rpy((1.0, 2.0, 3.0), (0.0, 0.0, np.pi)),
        pose_from_xyz_rpy((1.0, 2.0, 5.5)),
        pose_from_xyz_rpy((101.0, 2.0, 3.0)),
    ]
    context.set_frame_poses(source, dict(zip(frames, X_WF, strict=True)))
    return SimpleNamespace(
        ids=ids,
        X_WF=X_WF,
        query=graph.query_object(context),
        names=SceneNames(graph.model_inspector()),
    )


def test_a_penetration_arrives_as_computed(
    balls: SimpleNamespace, over_the_wire: Callable[[Any], Any]
) -> None:
    """Radii 1 and 2 at 2.5 m: depth 0.5; A is lower, so the normal out of B into A is -z."""
    table = balls.query.compute_point_pair_penetration()
    msg = contacts_to_msg(table, balls.names, stamp_ns=1, frame_id="world", scene_version=2)
    (contact,) = over_the_wire(msg).points
    assert (contact.geometry_a.name, contact.geometry_b.name) == ("small_ball", "large_ball")
    assert contact.depth == pytest.approx(0.5, abs=1e-14)
    assert contact.normal.z == pytest.approx(-1.0, abs=1e-14)
    # A's deepest point is its top at 3 + 1, B's its bottom at 5.5 - 2.
    assert contact.point_a.z == pytest.approx(4.0, abs=1e-14)
    assert contact.point_b.z == pytest.approx(3.5, abs=1e-14)


def test_penetrations_are_columns(
    balls: SimpleNamespace, over_the_wire: Callable[[Any], Any]
) -> None:
    """The same pair as one row of each of two configurations."""
    table = balls.query.compute_point_pair_penetration()
    msg = over_the_wire(queries.point_contacts_to_msg([table, table], balls.names))
    assert list(msg.configuration_start) == [0, 1, 2]
    small, large, _ = (int(i) for i in balls.ids)
    assert (list(msg.id_a), list(msg.id_b)) == ([small] * 2, [large] * 2)
    np.testing.assert_allclose(msg.depth, [0.5, 0.5], rtol=0, atol=1e-14)
    # A's deepest point is its top at 3 + 1, B's its bottom at 5.5 - 2.
    np.testing.assert_allclose(msg.points_a, [1.0, 2.0, 4.0] * 2, rtol=0, atol=1e-14)
    np.testing.assert_allclose(msg.points_b, [1.0, 2.0, 3.5] * 2, rtol=0, atol=1e-14)
    np.testing.assert_allclose(msg.normals, [0.0, 0.0, -1.0] * 2, rtol=0, atol=1e-14)
    assert (list(msg.geometries.id), msg.geometries.name) == (
        [small, large],
        ["small_ball", "large_ball"],
    )
    assert len(queries.point_contacts_to_msg([table], None).geometries.id) == 0


def test_signed_distances_arrive_as_computed(
    balls: SimpleNamespace, over_the_wire: Callable[[Any], Any]
) -> None:
    """Three pairs; the one along x is 100 m apart minus radii 1 and 0.5."""
    table = balls.query.compute_signed_distance_pairwise_closest_points()
    msg = over_the_wire(queries.signed_distances_to_msg([table], balls.names))
    assert list(msg.configuration_start) == [0, 3]
    small, large, far = (int(i) for i in balls.ids)
    assert list(zip(msg.id_a, msg.id_b, strict=True)) == [
        (small, large),
        (small, far),
        (large, far),
    ]
    np.testing.assert_allclose(msg.distance[:2], [-0.5, 98.5], rtol=0, atol=1e-12)
    # The witness on the turned small ball towards +x is at -x in its own frame.
    np.testing.assert_allclose(msg.points_a_in_a[3:6], [-1.0, 0.0, 0.0], rtol=0, atol=1e-12)
    np.testing.assert_allclose(msg.points_b_in_b[3:6], [-0.5, 0.0, 0.0], rtol=0, atol=1e-12)
    np.testing.assert_allclose(msg.normals[3:6], [-1.0, 0.0, 0.0], rtol=0, atol=1e-12)
    assert list(msg.is_normal_unique) == [1, 1, 1]
    assert msg.geometries.name == ["small_ball", "large_ball", "far_ball"]


def test_one_signed_distance_ties_its_fields_together(balls: SimpleNamespace) -> None:
    """point_a - point_b = distance * normal, as SignedDistancePair.msg says."""
    small, _, far = balls.ids
    record = balls.query.compute_signed_distance_pair_closest_points(small, far)
    msg = queries.signed_distance_pair_to_msg(record, balls.names, balls.X_WF[0], balls.X_WF[2])
    a, b, n = ([v.x, v.y, v.z] for v in (msg.point_a, msg.point_b, msg.normal))
    np.testing.assert_allclose(a, [2.0, 2.0, 3.0], rtol=0, atol=1e-12)
    np.testing.assert_allclose(np.subtract(a, b), msg.distance * np.array(n), rtol=0, atol=1e-12)


def test_point_distances_arrive_as_computed(
    balls: SimpleNamespace, over_the_wire: Callable[[Any], Any]
) -> None:
    """Two points: 1 m and 3 m above the small ball's center, within 0.1 m of a surface."""
    points = queries.points_from_msg([1.0, 2.0, 4.0, 1.0, 2.0, 6.0])
    table = balls.query.compute_signed_distance_to_points(points, threshold=0.1)
    msg = over_the_wire(queries.point_distances_to_msg([table], balls.names))
    small, large, _ = (int(i) for i in balls.ids)
    assert list(zip(msg.point, msg.id, strict=True)) == [(0, small), (0, large), (1, large)]
    # To the large ball's center at 5.5: |4 - 5.5| - 2 and |6 - 5.5| - 2.
    np.testing.assert_allclose(msg.distance, [0.0, -0.5, -1.5], rtol=0, atol=1e-14)
    np.testing.assert_allclose(msg.gradients[8], 1.0, rtol=0, atol=1e-14)


def test_candidates_arrive_as_computed(balls: SimpleNamespace) -> None:
    """Only the two balls whose boxes meet."""
    msg = queries.candidates_to_msg([balls.query.find_collision_candidates()], None)
    assert (list(msg.id_a), list(msg.id_b)) == ([int(balls.ids[0])], [int(balls.ids[1])])
