"""Every service of the node, over DDS: answers, statuses, ownership, limits."""

from __future__ import annotations

import math

from builtin_interfaces.msg import Duration, Time
from node_harness import wait_until
import numpy as np
import pytest
from scene_requests import pose, RADIUS, reference, register_balls, transform, what_if
from sensor_msgs.msg import MultiDOFJointState

from scene_graph_msgs.msg import (
    GeometryDescription,
    QueryOptions,
    RoleProperties,
    Shape,
    Status,
    WhatIf,
)
from scene_graph_msgs.srv import HasCollisions


@pytest.fixture(scope="module")
def node(start_node):
    """A node with an empty scene."""
    return start_node({"max_points_per_request": 200000, "max_rows_per_response": 150000})


@pytest.fixture(scope="module")
def scene(client, node):
    """Two balls that overlap, of source "balls"."""
    return register_balls(client)


def test_penetration(client, scene):
    """The overlap of two spheres has the depth and witnesses that geometry demands."""
    answer = client.call("ComputePointPairPenetration")
    assert answer.status.code == Status.OK, answer.status
    table = answer.table
    assert list(table.configuration_start) == [0, 1]
    assert list(table.depth) == pytest.approx([2 * RADIUS - 0.5], abs=1e-12)
    assert list(table.geometries.id) == [*table.id_a, *table.id_b]
    assert table.geometries.name == ["ball_a", "ball_b"]
    assert table.geometries.source == ["balls"] * 2
    # The deepest point of A in B is on A towards B; the normal points out of B into A.
    assert list(table.points_a) == pytest.approx([RADIUS, 0.0, 0.0], abs=1e-12)
    assert list(table.points_b) == pytest.approx([0.5 - RADIUS, 0.0, 0.0], abs=1e-12)
    assert list(table.normals) == pytest.approx([-1.0, 0.0, 0.0], abs=1e-12)


def test_what_if_asks_without_moving_anything(client, scene):
    """Three configurations answer for their own poses and the world stays as it was."""
    options = what_if("balls/b", (0.5, 0, 0), (2, 0, 0), (0, 0.4, 0))
    answer = client.call("ComputePointPairPenetration", options=options)
    assert list(answer.table.configuration_start) == [0, 1, 1, 2]
    assert answer.table.depth[1] == pytest.approx(0.2, abs=1e-12)
    answer = client.call("HasCollisions", options=options)
    assert list(answer.has_collisions) == [1, 0, 1]
    assert len(client.call("ComputePointPairPenetration").table.depth) == 1


def test_what_if_with_a_bad_pose_or_frame_is_refused(client, scene):
    """A quaternion that is none, and a frame that is not there, get their own status."""
    bad = QueryOptions(what_if=WhatIf(frames=["b"], poses=[0.0, 0, 0, 0, 0, 0, 2.0]))
    assert client.call("HasCollisions", options=bad).status.code == Status.INVALID_ARGUMENT
    unknown = client.call("HasCollisions", options=what_if("nobody", (0, 0, 0)))
    assert unknown.status.code == Status.UNKNOWN_NAME
    assert "nobody" in unknown.status.message


def test_signed_distances_of_all_pairs(client, scene):
    """The table of pairs has one row with the signed distance, and a legend of names."""
    answer = client.call("ComputeSignedDistancePairwise", options=what_if("b", (1, 0, 0)))
    assert answer.status.code == Status.OK, answer.status
    assert list(answer.table.distance) == pytest.approx([1.0 - 2 * RADIUS], abs=1e-12)
    assert answer.table.geometries.name == ["ball_a", "ball_b"]
    near = client.call(
        "ComputeSignedDistancePairwise", options=what_if("b", (1, 0, 0)), max_distance=[0.1]
    )
    assert len(near.table.distance) == 0


def test_signed_distance_of_named_pairs(client, scene):
    """A pair asked for in either order is answered with A the smaller id."""
    answer = client.call(
        "ComputeSignedDistancePair",
        geometries_a=["balls/b/ball_b"],
        geometries_b=["ball_a"],
    )
    assert answer.status.code == Status.OK, answer.status
    (pair,) = answer.pairs
    assert pair.status.code == Status.OK
    assert pair.geometry_a.name == "ball_a"
    assert pair.distance == pytest.approx(0.5 - 2 * RADIUS, abs=1e-12)
    assert pair.point_b_in_b.x == pytest.approx(-RADIUS, abs=1e-12)
    mixed = client.call(
        "ComputeSignedDistancePair",
        geometries_a=["ghost", "ball_b", "ball_a"],
        geometries_b=["ball_a", "ball_a", "ball_a"],
    )
    assert mixed.status.code == Status.OK
    codes = [pair.status.code for pair in mixed.pairs]
    assert codes[:2] == [Status.UNKNOWN_NAME, Status.OK]
    assert codes[2] == Status.UNSUPPORTED_PAIR, "a geometry has no distance to itself"


def test_two_half_spaces_have_no_distance_but_other_pairs_do(client, scene):
    """The one unsupported pair gets its own status inside an answer that is fine otherwise."""
    floor = Shape(kind=Shape.HALF_SPACE)
    role = [RoleProperties(role=RoleProperties.PROXIMITY)]
    planes = [
        GeometryDescription(name=name, shape=floor, pose=pose(z=z), roles=role)
        for name, z in (("low", -5.0), ("lower", -6.0))
    ]
    registered = client.call("RegisterAnchoredGeometry", source=scene, geometries=planes)
    assert registered.status.code == Status.OK, registered.status
    answer = client.call(
        "ComputeSignedDistancePair",
        geometries_a=["low", "ball_a"],
        geometries_b=["lower", "low"],
    )
    assert answer.status.code == Status.OK
    assert [pair.status.code for pair in answer.pairs] == [Status.UNSUPPORTED_PAIR, Status.OK]
    assert answer.pairs[1].distance == pytest.approx(5.0 - RADIUS, abs=1e-12)
    removed = client.call(
        "RemoveGeometry", source=scene, geometries=[reference("low"), reference("lower")]
    )
    assert removed.status.code == Status.OK


def test_distance_to_points(client, scene):
    """A point has a distance, a nearest point and a gradient for each ball in reach."""
    answer = client.call(
        "ComputeSignedDistanceToPoint", points=[-1.0, 0.0, 0.0, 0.5, 0.0, 1.0], threshold=[0.75]
    )
    assert answer.status.code == Status.OK, answer.status
    # |(-1,0,0) - a| - r = 0.7 is in reach, that to b is 1.2; (0.5,0,1) is 0.7 from b
    # and sqrt(1.25) - 0.3 = 0.818 from a.
    assert list(answer.table.point) == [0, 1]
    assert list(answer.table.distance) == pytest.approx([0.7, 0.7], abs=1e-12)
    np.testing.assert_allclose(answer.table.gradients, [-1, 0, 0, 0, 0, 1], atol=1e-12)


def test_a_hundred_thousand_points_are_answered_and_more_are_refused(client, scene):
    """100 000 points within a threshold are computed; beyond the limits it is TOO_LARGE."""
    rng = np.random.default_rng(5)
    points = rng.uniform(-3, 3, (100_000, 3))
    points[0] = (0.0, 0.0, RADIUS + 0.05)
    answer = client.call(
        "ComputeSignedDistanceToPoint", points=points.ravel().tolist(), threshold=[0.1]
    )
    assert answer.status.code == Status.OK, answer.status
    near = [np.linalg.norm(points - [x, 0, 0], axis=1) - RADIUS <= 0.1 for x in (0.0, 0.5)]
    assert len(answer.table.distance) == sum(int(mask.sum()) for mask in near)
    everything = client.call("ComputeSignedDistanceToPoint", points=points.ravel().tolist())
    assert everything.status.code == Status.TOO_LARGE
    assert "max_rows_per_response" in everything.status.message
    many = client.call("ComputeSignedDistanceToPoint", points=[0.0] * 3 * 200_001)
    assert many.status.code == Status.TOO_LARGE
    assert "max_points_per_request" in many.status.message


def test_points_that_are_no_points_are_refused(client, scene):
    """A number too many, and a NaN, are INVALID_ARGUMENT."""
    for points in ([0.0, 0.0], [math.nan, 0.0, 0.0]):
        answer = client.call("ComputeSignedDistanceToPoint", points=points)
        assert answer.status.code == Status.INVALID_ARGUMENT


def test_candidates(client, scene):
    """Spheres whose boxes overlap are candidates, those far apart are not."""
    answer = client.call("FindCollisionCandidates", options=what_if("b", (0.5, 0, 0), (9, 0, 0)))
    assert answer.status.code == Status.OK, answer.status
    assert list(answer.table.configuration_start) == [0, 1, 1]


def test_poses_in_world(client, scene):
    """Frames come before geometries, configuration after configuration."""
    answer = client.call(
        "GetPoseInWorld",
        options=what_if("b", (4, 0, 0), (5, 0, 0)),
        frames=["balls/b"],
        geometries=[reference("ball_a")],
    )
    assert answer.status.code == Status.OK, answer.status
    assert [p.position.x for p in answer.poses] == [4.0, 0.0, 5.0, 0.0]


def test_description(client, scene):
    """The scene is described with sources, frames, geometries, and shapes where asked."""
    answer = client.call("DescribeScene", source="balls", with_shapes=True)
    assert answer.status.code == Status.OK, answer.status
    (source,) = answer.sources
    assert (source.name, source.pose_topic) == ("balls", "/balls/poses")
    assert source.pose_type == "sensor_msgs/msg/MultiDOFJointState"
    assert [frame.name for frame in answer.frames] == ["a", "b"]
    assert answer.frames[1].pose.position.x == 0.5
    assert answer.frames[1].parent == "world"
    ball = answer.geometries[0]
    assert (ball.geometry.name, list(ball.description.shape.dimensions)) == ("ball_a", [RADIUS])
    assert list(ball.roles) == [RoleProperties.PROXIMITY]
    assert client.call("DescribeScene", source="ghost").status.code == Status.UNKNOWN_NAME


def test_minimal_stamp_waits_for_poses(client, scene):
    """A query waits for poses of its stamp without stopping the world, and gets their answer."""
    publisher = client.publisher(MultiDOFJointState, "/balls/poses")
    stamp = client.now()
    options = QueryOptions(minimal_stamp=stamp, timeout=Duration(sec=20))
    future = client.start("GetPoseInWorld", options=options, frames=["balls/b"])
    assert client.call("HasCollisions").status.code == Status.OK
    assert not future.done()
    message = MultiDOFJointState(joint_names=["b"])
    message.header.stamp = stamp
    message.transforms.append(transform(7.0))
    publisher.publish(message)
    wait_until(future.done, "the answer to a query that waits")
    answer = future.result()
    assert answer.status.code == Status.OK, answer.status
    assert answer.poses[0].position.x == 7.0
    assert answer.stamp == stamp
    # Back to where the other tests expect the ball.
    message.header.stamp = client.now()
    message.transforms = [transform(0.5)]
    publisher.publish(message)
    client.call(
        "HasCollisions",
        options=QueryOptions(minimal_stamp=message.header.stamp, timeout=Duration(sec=20)),
    )


def test_minimal_stamp_that_never_comes_is_stale(client, scene):
    """Without waiting, and after waiting in vain, the status is STALE."""
    future_stamp = Time(sec=2**31 - 1)
    for timeout in (Duration(), Duration(nanosec=200_000_000)):
        options = QueryOptions(minimal_stamp=future_stamp, timeout=timeout)
        answer = client.call("HasCollisions", options=options)
        assert answer.status.code == Status.STALE


def test_a_service_that_does_not_exist_is_not_answered_and_harms_nothing(client, scene):
    """A request to an unknown name waits for nobody; the others are answered as before."""
    unknown = client.node.create_client(HasCollisions, "/scene_graph/no_such_service")
    assert not unknown.wait_for_service(timeout_sec=0.2)
    future = unknown.call_async(HasCollisions.Request())
    assert client.call("HasCollisions").status.code == Status.OK
    assert not future.done()
    client.destroy(unknown)


def test_effects_are_listed_with_reasons(client, scene):
    """Each effect says whether it is on and why."""

    def listed():
        return {effect.name: effect for effect in client.call("ListEffects").effects}

    # Effects follow the scene with the next update.
    wait_until(lambda: listed()["point_contact"].is_on, "the effect")
    effects = listed()
    assert "proximity role" in effects["point_contact"].reason
    assert "/scene_graph/contacts" in list(effects["point_contact"].topics)
    assert not effects["perception"].is_on
    assert "perception role" in effects["perception"].reason


def test_the_node_survived_all_of_it(client, node):
    """After all these requests the node lives, answers, and has no internal error on record."""
    assert node.is_alive()
    assert client.call("HasCollisions").status.code == Status.OK
    assert "Traceback" not in node.output()
