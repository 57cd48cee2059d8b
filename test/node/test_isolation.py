"""One bad name, one odd pair, one edit of one client: refused, and nobody else notices."""

from __future__ import annotations

from geometry_msgs.msg import PoseStamped
import pytest
from scene_requests import pose, reference, register_balls, sphere, transform
from sensor_msgs.msg import MultiDOFJointState

from scene_graph_msgs.msg import (
    ContactArray,
    FrameDescription,
    GeometryDescription,
    RoleProperties,
    Shape,
    Status,
)

SOURCE = "version: 1\nsources:\n  - "
FRAME = "\nframes: [{name: f, source: s}]\n"
PLANES = """
version: 1
sources: [{name: planes}]
frames: [{name: f, source: planes}]
geometries:
  - {name: floor, source: planes, shape: {type: half_space}}
  - {name: wall, source: planes, frame: f, shape: {type: half_space}}
"""


@pytest.fixture(scope="module")
def node(start_node):
    """A node with an empty scene."""
    return start_node()


@pytest.fixture(scope="module")
def contacts(client, node):
    """The contacts of two balls of an innocent source."""
    register_balls(client)
    return client.listen(ContactArray, "contacts")


@pytest.fixture(autouse=True)
def unaffected(client, node, contacts):
    """After each test the scene is as before, can be described, and contacts still come."""
    before = client.call("DescribeScene")
    assert before.status.code == Status.OK
    yield
    after = client.call("DescribeScene")
    assert after.status.code == Status.OK
    assert [s.name for s in after.sources] == [s.name for s in before.sources]
    assert len(after.geometries) == len(before.geometries)
    count = contacts.count
    contacts.wait_for_newest(lambda m: contacts.count > count and len(m.points) == 1, "contacts")
    assert "Traceback" not in node.output()


def plane(name):
    """Return a half space with the proximity role."""
    roles = [RoleProperties(role=RoleProperties.PROXIMITY)]
    return GeometryDescription(
        name=name, shape=Shape(kind=Shape.HALF_SPACE), pose=pose(), roles=roles
    )


@pytest.mark.parametrize(
    ("name", "rule"),
    [
        ("arm-left", "letters, digits and '_'"),
        ("Robot 1", "letters, digits and '_'"),
        ("1digit", "begin with no digit"),
        ("é☃", "letters, digits and '_'"),
        ("{node}", "letters, digits and '_'"),
        ("~", "letters, digits and '_'"),
        ("x" * 250, "too long"),
        ("x" * 300, "at most 255 characters"),
        ("x" * 10**6, "at most 255 characters"),
        ("a//b", "no '/'"),
        ("a/", "no '/'"),
        ("/abs", "no '/'"),
        ("a\n[ERROR] made up", "printable"),
        (" \t", "empty"),
        ("", "empty"),
    ],
)
def test_a_name_that_makes_no_topic_is_refused(client, name, rule):
    """With the rule and the name in quotes, however long; the caller may come again."""
    for _ in range(2):
        answer = client.call("RegisterSource", name=name)
        assert answer.status.code == Status.INVALID_ARGUMENT
        assert rule in answer.status.message
        assert "\n" not in answer.status.message
        assert len(answer.status.message) < 500


def test_sources_go_on_after_refusals(client):
    """One that is registered then has its topic, and its poses arrive."""
    assert client.call("RegisterSource", name="two words").status.code
    good = client.call("RegisterSource", name="good")
    assert (good.status.code, good.pose_topic) == (Status.OK, "/good/poses")
    frames = [FrameDescription(name="f", pose=pose())]
    assert client.call("RegisterFrame", source=good.source, frames=frames).status.code == Status.OK
    publisher = client.publisher(MultiDOFJointState, "/good/poses")
    message = MultiDOFJointState(joint_names=["f"], transforms=[transform(7.0)])
    publisher.publish(message)
    contacts_stamp = client.listen(ContactArray, "contacts")
    contacts_stamp.wait_for(lambda m: m.header.stamp.sec > 0, "contacts of the pose")
    moved = client.call("GetPoseInWorld", frames=["good/f"])
    assert moved.poses[0].position.x == 7.0
    client.forget(contacts_stamp)
    client.destroy(publisher)
    assert client.call("RemoveSource", source=good.source).status.code == Status.OK


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (SOURCE + "{name: s, poses: {topic: 'two words!'}}" + FRAME, "'two words!'"),
        (SOURCE + "{name: s, poses: {topic: ~/contacts}}" + FRAME, "the node itself uses it"),
        (
            SOURCE + "{name: s, poses: {topic: /balls/poses, "
            "type: geometry_msgs/msg/PoseStamped}}" + FRAME,
            "source 'balls' uses it",
        ),
        (SOURCE + "{name: Robot 1}" + FRAME.replace("source: s", "source: Robot 1"), "'Robot 1'"),
        (
            SOURCE + "{name: s, configurations: {topic: a b}}\ngeometries:\n  - {name: g, "
            "source: s, shape: {type: box, size: [1, 1, 1]}, deformable: {}}",
            "'a b'",
        ),
        (PLANES, "'planes/f/wall' and geometry 'planes/world/floor'"),
        (SOURCE + "{name: s}\neffects: {point_contact: 'off'}", "point_contact"),
    ],
)
def test_a_scene_that_would_harm_others_is_refused(client, text, message):
    """Whatever follows from it is looked at before it counts."""
    answer = client.call("LoadScene", text=text)
    assert answer.status.code in (Status.INVALID_ARGUMENT, Status.UNSUPPORTED_PAIR)
    assert message in answer.status.message


def test_a_name_that_makes_no_topic_is_fine_with_one(client):
    """A scene file may name a topic for it."""
    text = SOURCE + "{name: Robot 1, poses: {topic: robot_1/poses}}" + FRAME
    loaded = client.call("LoadScene", text=text.replace("source: s", "source: Robot 1"))
    assert loaded.status.code == Status.OK, loaded.status
    (described,) = client.call("DescribeScene", source="Robot 1").sources
    assert described.pose_topic == "/robot_1/poses"
    client.destroy(client.publisher(MultiDOFJointState, "/robot_1/poses"))
    client.call("RemoveSource", source=loaded.sources[0])


def test_a_topic_changes_its_type_with_its_source(client):
    """A source that goes takes its subscription along, also where it comes back at once."""
    for kind, name in (
        (MultiDOFJointState, "sensor_msgs/msg/MultiDOFJointState"),
        (PoseStamped, "geometry_msgs/msg/PoseStamped"),
    ):
        for _ in range(3):
            again = client.call("RegisterSource", name="again", pose_type=name)
            assert again.status.code == Status.OK, again.status
            client.destroy(client.publisher(kind, "/again/poses"))
            client.call("RemoveSource", source=again.source)


def test_half_spaces_that_move_against_each_other_are_refused(client):
    """By whatever edit they would come to be checked; both are named, and what to do."""
    source = client.call("RegisterSource", name="planes").source
    client.call(
        "RegisterFrame", source=source, frames=[FrameDescription(name="f", pose=pose(z=-50.0))]
    )
    floor = plane("floor")
    floor.pose.position.z = -100.0
    answer = client.call("RegisterAnchoredGeometry", source=source, geometries=[floor])
    assert answer.status.code == Status.OK, answer.status
    wall = {"source": source, "frame": "f", "geometries": [plane("wall")]}
    refused = client.call("RegisterGeometry", **wall)
    assert refused.status.code == Status.UNSUPPORTED_PAIR
    for part in ("'planes/f/wall'", "'planes/world/floor'", "filter the pair"):
        assert part in refused.status.message
    wall["geometries"][0].roles = []
    assert client.call("RegisterGeometry", **wall).status.code == Status.OK
    role = RoleProperties(role=RoleProperties.PROXIMITY)
    assign = {"source": source, "geometries": [reference("wall")], "role": role}
    assert client.call("AssignRole", **assign).status.code == Status.UNSUPPORTED_PAIR
    assert client.call("RemoveSource", source=source).status.code == Status.OK


def test_filtered_half_spaces_are_fine_until_the_filter_goes(client):
    """A scene that filters the pair is loaded."""
    text = PLANES.replace("{type: half_space}", "{type: half_space}, pose: {xyz: [0, 0, -100]}")
    text += "collision_filters: [{between: [[planes/f], [planes/world/floor]]}]\n"
    loaded = client.call("LoadScene", text=text)
    assert loaded.status.code == Status.OK, loaded.status
    client.call("RemoveSource", source=loaded.sources[0])


@pytest.mark.parametrize(
    ("name", "rule"),
    [
        ("world", "means the world frame"),
        ("/f", "'/'"),
        ("f/", "'/'"),
        ("a\nb", "printable"),
        ("x" * 10**6, "at most 255"),
    ],
)
def test_names_of_frames_and_geometry_are_held_to_the_rule(client, name, rule):
    """Of both, though a geometry may be called as the world."""
    source = client.call("RegisterSource", name="owner").source
    frames = [FrameDescription(name=name, pose=pose())]
    answer = client.call("RegisterFrame", source=source, frames=frames)
    assert answer.status.code == Status.INVALID_ARGUMENT
    assert rule in answer.status.message
    if name != "world":
        answer = client.call(
            "RegisterAnchoredGeometry", source=source, geometries=[sphere(name, at=pose(z=90.0))]
        )
        assert answer.status.code == Status.INVALID_ARGUMENT
        assert rule in answer.status.message
    slashed = [FrameDescription(name="left/hand/link 1", pose=pose())]
    assert client.call("RegisterFrame", source=source, frames=slashed).status.code == Status.OK
    client.call("RemoveSource", source=source)


def test_names_from_the_network_make_no_lines_in_the_log(client, node):
    """A name of a message is quoted, and cut where it is long."""
    publisher = client.publisher(MultiDOFJointState, "/balls/poses")
    fake = "[ERROR] [1.0] [scene_graph]: made up"
    for name in (f"a\n{fake}", "y" * 10**5):
        publisher.publish(MultiDOFJointState(joint_names=[name], transforms=[transform(0.0)]))
    node.wait_for_output("'yyyy")
    lines = node.output().splitlines()
    assert not [line for line in lines if line.startswith(fake)]
    assert [line for line in lines if f"a\\n{fake}" in line]
    assert max(map(len, lines)) < 1000
    client.destroy(publisher)
