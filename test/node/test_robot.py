"""Poses that are not sent as poses: joint positions of a robot with a URDF, and TF."""

from __future__ import annotations

import math

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Quaternion, Transform, TransformStamped, Vector3
from node_harness import diagnostics_values, wait_until
import pytest
from sensor_msgs.msg import JointState
from workspace_messages import message_class, WORKSPACE_VARIABLES

from msg_adapters.stamps import stamp_from_msg, stamp_to_msg

URDF = """<?xml version="1.0"?>
<robot name="arm">
  <link name="base"/>
  <link name="upper"><collision><origin xyz="0.5 0 0"/><geometry><sphere radius="0.1"/></geometry>
  </collision></link>
  <link name="lower"><collision><origin xyz="0.5 0 0"/><geometry><sphere radius="0.1"/></geometry>
  </collision></link>
  <link name="tool"><collision><geometry><sphere radius="0.1"/></geometry></collision></link>
  <joint name="slide" type="prismatic"><parent link="lower"/><child link="tool"/>
    <origin xyz="1 0 0"/><axis xyz="0 0 1"/>
    <limit lower="0" upper="1" effort="1" velocity="1"/></joint>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
    <axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/>
    <origin xyz="1 0 0"/><axis xyz="0 0 1"/>
    <limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
</robot>
"""

TF_SCENE = """
version: 1
sources:
  - {name: tracked, poses: {type: tf2_msgs/msg/TFMessage}}
frames:
  - {name: cup, source: tracked}
  - {name: lid, source: tracked, parent: cup}
geometries:
  - {name: cup, source: tracked, frame: cup, shape: {type: sphere, radius: 0.1}}
"""


def where(client, name):
    """Return the pose of a frame in the world."""
    answer = client.call("GetPoseInWorld", frames=[name])
    assert answer.status.code == 0, answer.status
    return answer.poses[0]


@pytest.fixture(scope="module")
def robot(start_node, tmp_path_factory):
    """A node with a two-link arm in the plane z = 0, links 1 m long, with a tool to lift."""
    folder = tmp_path_factory.mktemp("robot")
    (folder / "arm.urdf").write_text(URDF)
    scene = folder / "arm.yaml"
    scene.write_text("version: 1\nrobots:\n  - {name: arm, urdf: arm.urdf}\n")
    node = start_node({"scene": scene, "diagnostics_rate": 20.0})
    yield node
    node.stop()


@pytest.fixture(scope="module")
def joints(client, robot):
    """Publish joint positions."""
    publisher = client.publisher(JointState, "/joint_states")

    def publish(stamp=None, **positions):
        message = JointState(name=list(positions), position=list(positions.values()))
        message.header.stamp = stamp or client.now()
        publisher.publish(message)

    return publish


def test_joint_positions_move_links(client, joints):
    """Shoulder at 90 degrees, elbow at -90: the lower link starts at (0, 1), unrotated."""
    joints(shoulder=math.pi / 2, elbow=-math.pi / 2)
    wait_until(lambda: abs(where(client, "lower").position.y - 1.0) < 1e-12, "a pose")
    lower = where(client, "lower")
    assert lower.position.x == pytest.approx(0.0, abs=1e-12)
    assert lower.orientation.w == pytest.approx(1.0, abs=1e-12)


def test_a_joint_alone_leaves_the_others(client, joints):
    """With the shoulder back at zero the elbow keeps its angle."""
    joints(shoulder=0.0)
    wait_until(lambda: abs(where(client, "lower").position.x - 1.0) < 1e-12, "a pose")
    half = math.sqrt(0.5)
    assert where(client, "lower").orientation.z == pytest.approx(-half, abs=1e-12)


def test_bad_positions_and_unknown_joints_change_nothing(client, joints):
    """NaN, and a joint of another robot, are counted."""
    diagnostics = client.listen(DiagnosticArray, "/diagnostics")
    joints(shoulder=math.nan, wheel=1.0)

    def seen_both(message):
        values = diagnostics_values(message, "source arm")
        return values.get("not_finite") == "1" and values.get("unknown_frame") == "1"

    diagnostics.wait_for(seen_both, "both faults in diagnostics")
    assert where(client, "lower").position.x == pytest.approx(1.0, abs=1e-12)


def test_a_position_beyond_all_measure_changes_nothing(client, joints):
    """What no pose may be is no joint's position either; the next message counts again."""
    diagnostics = client.listen(DiagnosticArray, "/diagnostics")
    joints(slide=1e13)
    diagnostics.wait_for(
        lambda m: diagnostics_values(m, "source arm").get("not_finite") == "2", "the fault"
    )
    assert where(client, "tool").position.z == 0.0
    joints(slide=0.25)
    wait_until(lambda: where(client, "tool").position.z == 0.25, "a pose")


def test_positions_out_of_order_are_not_even_remembered(client, joints):
    """A late message about one joint must not come back with the next about another."""
    now = client.now()
    joints(stamp=now, slide=0.5, elbow=-math.pi / 2)
    wait_until(lambda: where(client, "tool").position.z == 0.5, "a pose")
    joints(stamp=stamp_to_msg(stamp_from_msg(now) - 10**9), elbow=1.0)
    joints(shoulder=math.pi / 2)
    wait_until(lambda: abs(where(client, "lower").position.y - 1.0) < 1e-12, "a pose")
    # Shoulder 90 and elbow -90 degrees; had the late elbow counted, it would be turned.
    assert where(client, "lower").orientation.w == pytest.approx(1.0, abs=1e-12)


def test_a_robot_imports_nothing_but_ours(client, robot):
    """Nothing asks for TF; links are placed without any other library."""
    diagnostics = client.listen(DiagnosticArray, "/diagnostics")
    message = diagnostics.wait_for_newest(lambda m: True, "diagnostics")
    assert "tf2_msgs" not in diagnostics_values(message, "world")["imported"]
    assert "Traceback" not in robot.output()


@pytest.fixture(scope="module")
def tf_message():
    """Return the class of TF messages."""
    return message_class("tf2_msgs", "TFMessage")


def test_tf_moves_its_frames_and_ignores_those_of_others(
    client, robot, start_node, tf_message, tmp_path
):
    """Transforms of the source's frames are applied, the rest of TF is passed over quietly."""
    robot.stop()
    scene = tmp_path / "tf.yaml"
    scene.write_text(TF_SCENE)
    node = start_node({"scene": scene}, extra_environment=WORKSPACE_VARIABLES)
    publisher = client.publisher(tf_message, "/tf")
    transforms = []
    for child, parent, x in (("cup", "world", 3.0), ("lid", "cup", 0.5), ("map", "earth", 9.0)):
        item = TransformStamped(child_frame_id=child)
        item.transform = Transform(translation=Vector3(x=x), rotation=Quaternion(w=1.0))
        item.header.frame_id = parent
        item.header.stamp = client.now()
        transforms.append(item)
    publisher.publish(tf_message(transforms=transforms))
    wait_until(lambda: abs(where(client, "lid").position.x - 3.5) < 1e-12, "TF of the lid")
    assert "'map'" not in node.output()
