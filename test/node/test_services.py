"""Every service of the node, over DDS: answers, statuses, ownership, limits."""

from __future__ import annotations

import math

from builtin_interfaces.msg import Duration, Time
from geometry_msgs.msg import Point, Pose, Quaternion
from node_harness import wait_until
import numpy as np
import pytest
from scene_graph_msgs.msg import (
    CollisionFilterStatement,
    FrameDescription,
    GeometryDescription,
    GeometryReference,
    GeometrySet,
    Property,
    QueryOptions,
    RoleProperties,
    Shape,
    SourceHandle,
    Status,
    WhatIf,
)
from scene_graph_msgs.srv import AssignRole
from sensor_msgs.msg import MultiDOFJointState

RADIUS = 0.3


def pose(x=0.0, y=0.0, z=0.0):
    """Return a pose without rotation."""
    return Pose(position=Point(x=x, y=y, z=z), orientation=Quaternion(w=1.0))


def sphere(name, radius=RADIUS, at=None, roles=(RoleProperties.PROXIMITY,)):
    """Return the description of a sphere."""
    return GeometryDescription(
        name=name,
        shape=Shape(kind=Shape.SPHERE, dimensions=[radius]),
        pose=at or pose(),
        roles=[RoleProperties(role=role) for role in roles],
    )


def reference(name):
    """Return a reference by name."""
    return GeometryReference(name=name)


def what_if(frame, *positions):
    """Return configurations in which one frame is at each of the positions."""
    poses = [number for p in positions for number in (*map(float, p), 0.0, 0.0, 0.0, 1.0)]
    return QueryOptions(what_if=WhatIf(frames=[frame], poses=poses))


@pytest.fixture(scope="module")
def node(start_node):
    """A node with an empty scene."""
    return start_node({"max_points_per_request": 200000, "max_rows_per_response": 150000})


@pytest.fixture(scope="module")
def scene(client, node):
    """Two spheres on frames of one source 0.5 m apart, so that they overlap by 0.1 m.

    The gap is |AB| - 2 RADIUS = 0.5 - 0.6 = -0.1.
    """
    source = client.call("RegisterSource", name="balls").source
    frames = [
        FrameDescription(name="a", pose=pose()),
        FrameDescription(name="b", pose=pose(x=0.5)),
    ]
    answer = client.call("RegisterFrame", source=source, frames=frames)
    assert answer.status.code == Status.OK, answer.status
    for frame in ("a", "b"):
        answer = client.call(
            "RegisterGeometry", source=source, frame=frame, geometries=[sphere(f"ball_{frame}")]
        )
        assert answer.status.code == Status.OK, answer.status
    return source


def test_registration_returns_ids_a_topic_and_a_growing_version(client, node):
    """A source gets a token and a topic; each change raises the version of the scene."""
    first = client.call("RegisterSource", name="newcomer")
    assert first.status.code == Status.OK
    assert first.source.token != 0
    assert first.pose_topic == "/newcomer/poses"
    second = client.call(
        "RegisterFrame", source=first.source, frames=[FrameDescription(name="f", pose=pose())]
    )
    assert second.scene_version > first.scene_version
    assert len(second.frame_ids) == 1
    assert client.call("RemoveSource", source=first.source).status.code == Status.OK


def test_a_source_comes_back_with_its_own_token_only(client, node):
    """A restarted caller gets its source back with its token; another is refused the name."""
    first = client.call("RegisterSource", name="phoenix", token=77)
    again = client.call("RegisterSource", name="phoenix", token=77)
    assert (again.status.code, again.source) == (Status.OK, first.source)
    assert client.call("RegisterSource", name="phoenix", token=78).status.code == (
        Status.NAME_CONFLICT
    )
    assert client.call("RegisterSource", name="phoenix").status.code == Status.NAME_CONFLICT
    client.call("RemoveSource", source=first.source)


def test_unknown_pose_type_is_refused(client, node):
    """A message type that is no pose input is named in the refusal, and nothing is registered."""
    answer = client.call("RegisterSource", name="odd", pose_type="std_msgs/msg/String")
    assert answer.status.code == Status.INVALID_ARGUMENT
    assert "std_msgs/msg/String" in answer.status.message
    assert "odd" not in [s.name for s in client.call("DescribeScene").sources]


def test_penetration(client, scene):
    """The overlap of two spheres has the depth and witnesses that geometry demands."""
    answer = client.call("ComputePointPairPenetration")
    assert answer.status.code == Status.OK, answer.status
    assert list(answer.configuration_start) == [0, 1]
    (contact,) = answer.contacts
    assert contact.depth == pytest.approx(2 * RADIUS - 0.5, abs=1e-12)
    assert contact.geometry_a.id < contact.geometry_b.id
    assert contact.geometry_a.name == "ball_a"
    # The deepest point of A in B is on A towards B; the normal points out of B into A.
    assert contact.point_a.x == pytest.approx(RADIUS, abs=1e-12)
    assert contact.point_b.x == pytest.approx(0.5 - RADIUS, abs=1e-12)
    assert contact.normal.x == pytest.approx(-1.0, abs=1e-12)


def test_what_if_asks_without_moving_anything(client, scene):
    """Three configurations answer for their own poses and the world stays as it was."""
    options = what_if("balls/b", (0.5, 0, 0), (2, 0, 0), (0, 0.4, 0))
    answer = client.call("ComputePointPairPenetration", options=options)
    assert list(answer.configuration_start) == [0, 1, 1, 2]
    assert answer.contacts[1].depth == pytest.approx(0.2, abs=1e-12)
    answer = client.call("HasCollisions", options=options)
    assert list(answer.has_collisions) == [1, 0, 1]
    assert len(client.call("ComputePointPairPenetration").contacts) == 1


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
    assert [name.name for name in answer.table.geometries] == ["ball_a", "ball_b"]
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


def test_only_the_owner_changes_what_it_registered(client, scene):
    """A wrong token and another source are NOT_OWNER, and the scene keeps its version."""
    before = client.call("DescribeScene").scene_version
    thief = client.call("RegisterSource", name="thief").source
    forged = SourceHandle(name="balls", token=scene.token ^ 1)
    answer = client.call("RemoveGeometry", source=forged, geometries=[reference("ball_a")])
    assert answer.status.code == Status.NOT_OWNER
    answer = client.call("RemoveGeometry", source=thief, geometries=[reference("ball_a")])
    assert answer.status.code == Status.NOT_OWNER
    unknown = client.call("RemoveFrame", source=SourceHandle(name="nobody", token=1), frames=["a"])
    assert unknown.status.code == Status.UNKNOWN_NAME
    assert client.call("DescribeScene").scene_version == before + 1
    client.call("RemoveSource", source=thief)


def test_a_request_is_done_wholly_or_not_at_all(client, scene):
    """One bad geometry among good ones leaves no trace of the good ones."""
    bad = sphere("bad", radius=-1.0)
    answer = client.call(
        "RegisterGeometry", source=scene, frame="a", geometries=[sphere("good"), bad]
    )
    assert answer.status.code == Status.INVALID_ARGUMENT
    assert len(answer.geometry_ids) == 0
    names = [g.geometry.name for g in client.call("DescribeScene").geometries]
    assert "good" not in names


def test_names_are_taken_once(client, scene):
    """A second frame of a name, and a second geometry, are NAME_CONFLICT."""
    twice = client.call("RegisterFrame", source=scene, frames=[FrameDescription(name="a", pose=pose())])
    assert twice.status.code == Status.NAME_CONFLICT
    ball = client.call(
        "RegisterGeometry", source=scene, frame="a", geometries=[sphere("ball_a")]
    )
    assert ball.status.code == Status.NAME_CONFLICT


def test_filters_are_applied_and_taken_back(client, scene):
    """A transient filter hides the contact; removing it brings the contact back."""
    both = GeometrySet(geometries=[reference("ball_a"), reference("ball_b")])
    statement = CollisionFilterStatement(
        operation=CollisionFilterStatement.EXCLUDE_WITHIN, a=both
    )
    applied = client.call(
        "ApplyCollisionFilter", source=scene, statements=[statement], is_transient=True
    )
    assert applied.status.code == Status.OK, applied.status
    pair = {"a": [reference("ball_a")], "b": [reference("ball_b")]}
    assert list(client.call("IsCollisionFiltered", **pair).is_filtered) == [1]
    assert list(client.call("HasCollisions").has_collisions) == [0]
    removed = client.call("RemoveCollisionFilter", source=scene, filter_id=applied.filter_id)
    assert removed.removed
    assert list(client.call("IsCollisionFiltered", **pair).is_filtered) == [0]
    assert list(client.call("HasCollisions").has_collisions) == [1]
    again = client.call("RemoveCollisionFilter", source=scene, filter_id=applied.filter_id)
    assert (again.status.code, again.removed) == (Status.OK, False)


def test_a_source_filters_pairs_of_its_own_geometry_only(client, scene):
    """A stranger may not switch off the collisions of others."""
    stranger = client.call("RegisterSource", name="stranger").source
    statement = CollisionFilterStatement(
        operation=CollisionFilterStatement.EXCLUDE_WITHIN, a=GeometrySet(frames=["a", "b"])
    )
    answer = client.call("ApplyCollisionFilter", source=stranger, statements=[statement])
    assert answer.status.code == Status.NOT_OWNER
    client.call("RemoveSource", source=stranger)


def test_roles_are_given_replaced_and_taken(client, scene):
    """A role is given once, replaced where it is there, and taken from a whole frame."""
    red = Property(group="phong", name="diffuse", type=Property.RGBA, doubles=[1.0, 0, 0, 1])
    role = RoleProperties(role=RoleProperties.ILLUSTRATION, properties=[red])
    ball = [reference("ball_a")]
    give = {"source": scene, "geometries": ball, "role": role}
    assert client.call("AssignRole", **give).status.code == Status.OK
    assert client.call("AssignRole", **give).status.code == Status.INVALID_ARGUMENT
    replaced = client.call("AssignRole", **give, assign=AssignRole.Request.REPLACE)
    assert replaced.status.code == Status.OK
    described = client.call(
        "DescribeScene", role=RoleProperties.ILLUSTRATION, with_properties=True
    )
    (info,) = described.geometries
    (illustration,) = [
        r for r in info.description.roles if r.role == RoleProperties.ILLUSTRATION
    ]
    assert list(illustration.properties[0].doubles) == [1.0, 0.0, 0.0, 1.0]
    taken = client.call(
        "RemoveRole", source=scene, frames=["a"], role=RoleProperties.ILLUSTRATION
    )
    assert (taken.status.code, taken.removed) == (Status.OK, 1)


def test_frames_go_with_what_hangs_on_them(client, scene):
    """Removing a frame removes its children and their geometry, and nothing else."""
    frames = [
        FrameDescription(name="parent", pose=pose(z=10.0)),
        FrameDescription(name="child", parent="parent", pose=pose(x=1.0)),
    ]
    answer = client.call("RegisterFrame", source=scene, frames=frames)
    assert answer.status.code == Status.OK, answer.status
    client.call("RegisterGeometry", source=scene, frame="child", geometries=[sphere("on_child")])
    found = client.call("GetPoseInWorld", geometries=[reference("on_child")])
    assert (found.poses[0].position.x, found.poses[0].position.z) == (1.0, 10.0)
    removed = client.call("RemoveFrame", source=scene, frames=["parent", "child"])
    assert removed.status.code == Status.OK, removed.status
    described = client.call("DescribeScene", source="balls")
    assert [frame.name for frame in described.frames] == ["a", "b"]
    assert [g.geometry.name for g in described.geometries] == ["ball_a", "ball_b"]


def test_geometry_hangs_on_geometry(client, scene):
    """A geometry on a geometry is placed relative to it and vanishes with it."""
    client.call("RegisterGeometry", source=scene, frame="a", geometries=[
        sphere("trunk", at=pose(z=20.0))])
    answer = client.call(
        "RegisterGeometry",
        source=scene,
        frame="a",
        parent_geometry=reference("trunk"),
        geometries=[sphere("leaf", at=pose(z=1.0))],
    )
    assert answer.status.code == Status.OK, answer.status
    found = client.call("GetPoseInWorld", geometries=[reference("leaf")])
    assert found.poses[0].position.z == 21.0
    client.call("RemoveGeometry", source=scene, geometries=[reference("trunk")])
    gone = client.call("GetPoseInWorld", geometries=[reference("leaf")])
    assert gone.status.code == Status.UNKNOWN_NAME


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
    message.transforms.append(_transform(7.0))
    publisher.publish(message)
    wait_until(future.done, "the answer to a query that waits")
    answer = future.result()
    assert answer.status.code == Status.OK, answer.status
    assert answer.poses[0].position.x == 7.0
    assert answer.stamp == stamp
    # Back to where the other tests expect the ball.
    message.header.stamp = client.now()
    message.transforms = [_transform(0.5)]
    publisher.publish(message)
    client.call(
        "HasCollisions",
        options=QueryOptions(minimal_stamp=message.header.stamp, timeout=Duration(sec=20)),
    )


def _transform(x):
    from geometry_msgs.msg import Transform, Vector3

    return Transform(translation=Vector3(x=x), rotation=Quaternion(w=1.0))


def test_minimal_stamp_that_never_comes_is_stale(client, scene):
    """Without waiting, and after waiting in vain, the status is STALE."""
    future_stamp = Time(sec=2**31 - 1)
    for timeout in (Duration(), Duration(nanosec=200_000_000)):
        options = QueryOptions(minimal_stamp=future_stamp, timeout=timeout)
        answer = client.call("HasCollisions", options=options)
        assert answer.status.code == Status.STALE


def test_scenes_are_loaded_from_text_and_refused_as_a_whole(client, node):
    """A scene adds its sources; one with a mistake adds none and says where the mistake is."""
    good = """
version: 1
sources:
  - name: cell
geometries:
  - name: table
    source: cell
    shape: {type: box, size: [1.0, 1.0, 0.1]}
    pose: {xyz: [30.0, 0.0, 0.0]}
"""
    bad = good.replace("type: box", "type: bax")
    refused = client.call("LoadScene", text=bad, prefix="x_")
    assert refused.status.code == Status.INVALID_ARGUMENT
    assert "bax" in refused.status.message
    loaded = client.call("LoadScene", text=good, prefix="x_")
    assert loaded.status.code == Status.OK, loaded.status
    (handle,) = loaded.sources
    assert handle.name == "x_cell"
    assert client.call("RemoveSource", source=handle).status.code == Status.OK


def test_effects_are_listed_with_reasons(client, scene):
    """Each effect says whether it is on and why."""
    answer = client.call("ListEffects")
    effects = {effect.name: effect for effect in answer.effects}
    assert effects["point_contact"].is_on
    assert "proximity role" in effects["point_contact"].reason
    assert "/scene_graph/contacts" in list(effects["point_contact"].topics)
    assert not effects["perception"].is_on
    assert "perception role" in effects["perception"].reason


def test_the_node_survived_all_of_it(client, node):
    """After all these requests the node lives, answers, and has no internal error on record."""
    assert node.is_alive()
    assert client.call("HasCollisions").status.code == Status.OK
    assert "Traceback" not in node.output()
