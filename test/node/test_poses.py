"""Poses in, contacts out: every message type, and everything that can be wrong with one."""

from __future__ import annotations

import math

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, Quaternion, Transform, TransformStamped, Vector3
from node_harness import diagnostics_from_now, diagnostics_values, wait_until
import pytest
from sensor_msgs.msg import MultiDOFJointState

from msg_adapters.stamps import stamp_from_msg, stamp_to_msg
from scene_graph_msgs.msg import ContactArray

SCENE = """
version: 1
sources:
  - name: multi
  - name: stamped
    poses: {type: geometry_msgs/msg/PoseStamped}
  - name: transform
    poses: {type: geometry_msgs/msg/TransformStamped, topic: transforms}
  - name: fixed
frames:
  - {name: m1, source: multi, pose: {xyz: [0.0, 0.0, 10.0]}}
  - {name: m2, source: multi, pose: {xyz: [0.0, 0.0, 20.0]}}
  - {name: m3, source: multi, parent: m1, pose: {xyz: [0.0, 50.0, 0.0]}}
  - {name: s, source: stamped, pose: {xyz: [0.0, 0.0, 30.0]}}
  - {name: t, source: transform, pose: {xyz: [0.0, 0.0, 40.0]}}
geometries:
  - {name: target, source: fixed, shape: {type: sphere, radius: 1.0}}
  - {name: ball_1, source: multi, frame: m1, shape: {type: sphere, radius: 1.0}}
  - {name: ball_2, source: multi, frame: m2, shape: {type: sphere, radius: 1.0}}
  - {name: ball_s, source: stamped, frame: s, shape: {type: sphere, radius: 1.0}}
  - {name: ball_t, source: transform, frame: t, shape: {type: sphere, radius: 1.0}}
"""


def transform(x=0.0, y=0.0, z=0.0, q=(0.0, 0.0, 0.0, 1.0)):
    """Return a transform; the quaternion is x, y, z, w."""
    return Transform(
        translation=Vector3(x=x, y=y, z=z), rotation=Quaternion(x=q[0], y=q[1], z=q[2], w=q[3])
    )


def multi(stamp, frame_id="", **transforms):
    """Return a pose message with named transforms."""
    message = MultiDOFJointState(
        joint_names=list(transforms), transforms=list(transforms.values())
    )
    message.header.stamp = stamp
    message.header.frame_id = frame_id
    return message


def depths(contacts):
    """Return the depth of each contact with the target by the name of the other ball."""
    return {
        name.name: contact.depth
        for contact in contacts.points
        for name in (contact.geometry_a, contact.geometry_b)
        if name.name != "target"
    }


@pytest.fixture(scope="module")
def node(start_node, tmp_path_factory):
    """A node with sources of three message types around one target at the origin."""
    scene = tmp_path_factory.mktemp("scene") / "poses.yaml"
    scene.write_text(SCENE)
    parameters = {"scene": scene, "diagnostics_rate": 20.0, "max_pose_age": 30.0}
    # What it has imported counts.
    return start_node(parameters, fresh=True)


@pytest.fixture(scope="module")
def contacts(client, node):
    """What the node says about contacts."""
    return client.listen(ContactArray, "contacts")


@pytest.fixture(scope="module")
def diagnostics(client, node):
    """What the node says about itself."""
    return client.listen(DiagnosticArray, "/diagnostics")


@pytest.fixture(scope="module")
def publishers(client, node):
    """A publisher for each source."""
    return {
        "multi": client.publisher(MultiDOFJointState, "/multi/poses"),
        "stamped": client.publisher(PoseStamped, "/stamped/poses"),
        "transform": client.publisher(TransformStamped, "/transforms"),
    }


@pytest.fixture
def fault_count(client, diagnostics):
    """Return how often a source had a fault, from a diagnostics message made after the call."""

    def count(source, fault):
        message = diagnostics_from_now(client, diagnostics)
        return int(diagnostics_values(message, f"source {source}")[fault])

    return count


def test_contacts_are_published_without_poses_and_without_contacts(client, contacts):
    """The message comes also where nothing touches, in the world frame."""
    message = contacts.wait_for_newest(lambda m: True, "a message about contacts")
    assert (len(message.points), len(message.surfaces)) == (0, 0)
    assert message.header.frame_id == "world"
    assert message.scene_version == client.call("DescribeScene").scene_version


def test_named_transforms_move_frames_and_their_children(client, contacts, publishers):
    """A MultiDOFJointState moves its frames; the contact has the stamp of the poses."""
    stamp = client.now()
    publishers["multi"].publish(multi(stamp, "world", m1=transform(x=1.5)))
    message = contacts.wait_for_newest(lambda m: "ball_1" in depths(m), "a contact of ball_1")
    # Radii 1 and 1, centres 1.5 apart.
    assert depths(message) == {"ball_1": pytest.approx(0.5, abs=1e-12)}
    assert message.header.stamp == stamp
    child = client.call("GetPoseInWorld", frames=["m3"]).poses[0].position
    assert (child.x, child.y) == (1.5, 50.0)


def test_partial_updates_hold_the_last_pose_of_the_others(client, contacts, publishers):
    """A message about one frame leaves the other where it was."""
    publishers["multi"].publish(multi(client.now(), m2=transform(y=-1.75)))
    message = contacts.wait_for_newest(lambda m: "ball_2" in depths(m), "a contact of ball_2")
    # ball_1 and ball_2 are |(1.5, 1.75)| = 2.30 apart and don't touch.
    assert depths(message) == {
        "ball_1": pytest.approx(0.5, abs=1e-12),
        "ball_2": pytest.approx(0.25, abs=1e-12),
    }


def test_partial_messages_in_one_burst_are_all_applied(client, contacts, publishers):
    """Messages about different frames that arrive together don't supersede each other."""
    for i in range(20):
        publishers["multi"].publish(multi(client.now(), m1=transform(x=1.5 + 0.01 * i)))
        publishers["multi"].publish(multi(client.now(), m2=transform(y=-1.75 - 0.01 * i)))
    contacts.wait_for_newest(
        lambda m: (
            depths(m)
            == {
                "ball_1": pytest.approx(0.5 - 0.19, abs=1e-12),
                "ball_2": pytest.approx(0.25 - 0.19, abs=1e-12),
            }
        ),
        "the last pose of both frames",
    )


def test_pose_stamped_moves_the_only_frame_of_its_source(client, contacts, publishers):
    """A PoseStamped in the world frame moves the frame."""
    message = PoseStamped()
    message.header.stamp = client.now()
    message.header.frame_id = "world"
    message.pose.position.z = 1.9
    message.pose.orientation.w = 1.0
    publishers["stamped"].publish(message)
    found = contacts.wait_for_newest(lambda m: "ball_s" in depths(m), "a contact of ball_s")
    assert depths(found)["ball_s"] == pytest.approx(0.1, abs=1e-12)


def test_transform_stamped_moves_its_child_frame(client, contacts, publishers):
    """A TransformStamped on a topic of its own name moves ``child_frame_id``."""
    message = TransformStamped(child_frame_id="t", transform=transform(z=-1.8))
    message.header.stamp = client.now()
    publishers["transform"].publish(message)
    found = contacts.wait_for_newest(lambda m: "ball_t" in depths(m), "a contact of ball_t")
    assert depths(found)["ball_t"] == pytest.approx(0.2, abs=1e-12)


FAULTS = {
    "not_finite": {"m1": transform(x=math.nan)},
    "not_unit": {"m1": transform(x=9.0, q=(0.0, 0.0, 0.0, 0.9))},
    "unknown_frame": {"nobody": transform(x=9.0)},
    "wrong_source": {"s": transform(x=9.0)},
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_bad_pose_is_counted_warned_about_once_and_changes_nothing(
    client, node, publishers, fault_count, fault
):
    """NaN, a non-unit quaternion, an unknown and a foreign frame change no pose."""
    frames = ["m1", "m2", "s", "t"]
    before = client.call("GetPoseInWorld", frames=frames).poses
    count = fault_count("multi", fault)
    for _ in range(3):
        publishers["multi"].publish(multi(client.now(), **FAULTS[fault]))
    wait_until(lambda: fault_count("multi", fault) == count + 3, f"three times {fault}")
    assert client.call("GetPoseInWorld", frames=frames).poses == before
    name = next(iter(FAULTS[fault]))
    warnings = [
        line
        for line in node.output().splitlines()
        if f"({fault};" in line and f"frame '{name}'" in line
    ]
    assert len(warnings) == 1
    assert "source 'multi'" in warnings[0]


def test_the_good_poses_of_a_message_are_applied(client, publishers, fault_count):
    """One bad pose refuses itself, not its neighbours."""
    count = fault_count("multi", "unknown_frame")
    message = multi(client.now(), ghost=transform(), m2=transform(y=-33.0))
    publishers["multi"].publish(message)
    wait_until(
        lambda: client.call("GetPoseInWorld", frames=["m2"]).poses[0].position.y == -33.0,
        "the good pose",
    )
    assert fault_count("multi", "unknown_frame") == count + 1


@pytest.mark.parametrize(
    ("fault", "seconds"), [("out_of_order", -1.0), ("stale", -60.0), ("future", 60.0)]
)
def test_a_message_out_of_time_is_counted_and_changes_nothing(
    client, publishers, fault_count, fault, seconds
):
    """Older than the last pose, older than allowed, or from the future: not applied."""
    now = client.now()
    publishers["multi"].publish(multi(now, m1=transform(x=70.0)))
    wait_until(
        lambda: client.call("GetPoseInWorld", frames=["m1"]).poses[0].position.x == 70.0,
        "the newest pose",
    )
    count = fault_count("multi", fault)
    stamp = stamp_to_msg(stamp_from_msg(now) + int(seconds * 1e9))
    publishers["multi"].publish(multi(stamp, m1=transform(x=80.0)))
    wait_until(lambda: fault_count("multi", fault) == count + 1, fault)
    assert client.call("GetPoseInWorld", frames=["m1"]).poses[0].position.x == 70.0


def test_a_pose_in_another_frame_than_the_parent_is_counted(client, publishers, fault_count):
    """The node does not guess: a pose in a frame that is not the parent is not applied."""
    count = fault_count("multi", "wrong_parent")
    publishers["multi"].publish(multi(client.now(), "map", m1=transform(x=5.0)))
    wait_until(lambda: fault_count("multi", "wrong_parent") == count + 1, "wrong_parent")
    # Given in its parent the child moves.
    publishers["multi"].publish(multi(client.now(), "m1", m3=transform(y=51.0)))
    wait_until(
        lambda: client.call("GetPoseInWorld", frames=["m3"]).poses[0].position.y == 51.0,
        "the pose of the child in its parent",
    )


def test_a_message_that_contradicts_itself_is_counted(client, publishers, fault_count):
    """More names than transforms are malformed."""
    count = fault_count("multi", "malformed")
    message = multi(client.now(), m1=transform(x=5.0))
    message.joint_names.append("m2")
    publishers["multi"].publish(message)
    wait_until(lambda: fault_count("multi", "malformed") == count + 1, "malformed")


def test_an_unstamped_pose_counts_as_sent_now(client, publishers):
    """A stamp of zero means the time of arrival."""
    message = multi(stamp_to_msg(0), m1=transform(x=71.0))
    publishers["multi"].publish(message)
    wait_until(
        lambda: client.call("GetPoseInWorld", frames=["m1"]).poses[0].position.x == 71.0,
        "the unstamped pose",
    )


def test_diagnostics_tell_rate_age_latency_and_drops(diagnostics):
    """Each source has a rate and an age, the world a latency."""
    message = diagnostics.wait_for_newest(lambda m: True, "diagnostics")
    values = diagnostics_values(message, "source multi")
    assert values["topic"] == "/multi/poses"
    # The burst of 40, and at least one message of each other test.
    assert int(values["messages received"]) > 40
    assert float(values["age (s)"]) < 60.0
    assert int(values["dropped"]) > 0
    assert float(values["rate (Hz)"]) >= 0.0
    world = diagnostics_values(message, "world")
    assert 0.0 < float(world["latency median (s)"]) < 5.0
    assert world["internal errors"] == "0"
    effect = diagnostics_values(message, "effect: point_contact")
    assert int(effect["computed"]) > 0


def test_what_the_scene_does_not_need_is_not_imported(diagnostics):
    """Spheres need neither mesh files, nor kinematics, nor TF."""
    message = diagnostics.wait_for_newest(lambda m: True, "diagnostics")
    assert diagnostics_values(message, "world")["imported"] == ""


def test_a_best_effort_publisher_is_heard(client, node, publishers):
    """A publisher that offers less than the node asks for gets a reader that takes it."""
    publisher = client.publisher(PoseStamped, "/stamped/poses", best_effort=True)
    message = PoseStamped()
    message.pose.orientation.w = 1.0

    def arrives():
        message.pose.position.x += 1.0
        message.header.stamp = client.now()
        publisher.publish(message)
        return client.call("GetPoseInWorld", frames=["s"]).poses[0].position.x >= 100.0

    message.pose.position.x = 100.0
    wait_until(arrives, "a pose from a best effort publisher")


def test_the_node_survived_all_of_it(client, node):
    """After all these messages the node lives and answers."""
    assert node.is_alive()
    assert client.call("HasCollisions").status.code == 0
    assert "Traceback" not in node.output()
