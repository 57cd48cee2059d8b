"""Services that change the scene: ownership, all or nothing, filters, roles, scenes."""

from __future__ import annotations

import pytest
from scene_requests import pose, reference, register_balls, sphere

from scene_graph_msgs.msg import (
    CollisionFilterStatement,
    FrameDescription,
    GeometrySet,
    Property,
    RoleProperties,
    SourceHandle,
    Status,
)
from scene_graph_msgs.srv import AssignRole
from scene_graph_ros.client import shapes


@pytest.fixture(scope="module")
def node(start_node):
    """A node with an empty scene."""
    return start_node()


@pytest.fixture(scope="module")
def scene(client, node):
    """Two balls that overlap, of source "balls"."""
    return register_balls(client)


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
    assert again.scene_version == first.scene_version
    assert client.call("RegisterSource", name="phoenix", token=78).status.code == (
        Status.NAME_CONFLICT
    )
    assert client.call("RegisterSource", name="phoenix").status.code == Status.NAME_CONFLICT
    client.call("RemoveSource", source=first.source)


def test_a_mesh_of_elsewhere_is_refused_whether_there_is_one_or_not(client, node, tmp_path):
    """Without a scene requests name files below packages; others are not looked at."""
    (tmp_path / "secret.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    source = client.call("RegisterSource", name="curious").source
    said = set()
    for name in ("secret.obj", "nothing.obj"):
        body = sphere("body")
        body.shape = shapes.mesh(str(tmp_path / name))
        answer = client.call("RegisterAnchoredGeometry", source=source, geometries=[body])
        assert answer.status.code == Status.INVALID_ARGUMENT
        said.add(answer.status.message.replace(name, "it"))
    assert len(said) == 1
    assert "resource_folders" in said.pop()
    client.call("RemoveSource", source=source)


def test_unknown_pose_type_is_refused(client, node):
    """A message type that is no pose input is named in the refusal, and nothing is registered."""
    answer = client.call("RegisterSource", name="odd", pose_type="std_msgs/msg/String")
    assert answer.status.code == Status.INVALID_ARGUMENT
    assert "std_msgs/msg/String" in answer.status.message
    assert "odd" not in [s.name for s in client.call("DescribeScene").sources]


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
    twice = client.call(
        "RegisterFrame", source=scene, frames=[FrameDescription(name="a", pose=pose())]
    )
    assert twice.status.code == Status.NAME_CONFLICT
    ball = client.call("RegisterGeometry", source=scene, frame="a", geometries=[sphere("ball_a")])
    assert ball.status.code == Status.NAME_CONFLICT


def test_filters_are_applied_and_taken_back(client, scene):
    """A transient filter hides the contact; removing it brings the contact back."""
    both = GeometrySet(geometries=[reference("ball_a"), reference("ball_b")])
    statement = CollisionFilterStatement(operation=CollisionFilterStatement.EXCLUDE_WITHIN, a=both)
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
    (illustration,) = [r for r in info.description.roles if r.role == RoleProperties.ILLUSTRATION]
    assert list(illustration.properties[0].doubles) == [1.0, 0.0, 0.0, 1.0]
    taken = client.call("RemoveRole", source=scene, frames=["a"], role=RoleProperties.ILLUSTRATION)
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
    client.call(
        "RegisterGeometry", source=scene, frame="a", geometries=[sphere("trunk", at=pose(z=20.0))]
    )
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


def test_the_node_survived_all_of_it(client, node):
    """After all these requests the node lives, answers, and has no internal error on record."""
    assert node.is_alive()
    assert client.call("HasCollisions").status.code == Status.OK
    assert "Traceback" not in node.output()
