"""Robots as they come: described by a topic, moved by several drivers, on a base that moves."""

from __future__ import annotations

import math

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from nav_msgs.msg import Odometry
from node_harness import diagnostics_values, wait_until
import pytest
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import JointState, MultiDOFJointState
from std_msgs.msg import String

from msg_adapters.poses import multi_dof_joint_state_to_msg
from msg_adapters.stamps import stamp_from_msg, stamp_to_msg
from scene_graph_msgs.msg import QueryOptions, Status
from scene_graph_ros.geometry.spatial.poses import pose_from_xyz_rpy

BALL = '<collision><geometry><sphere radius="0.1"/></geometry></collision>'
LIMIT = '<limit lower="-3" upper="3" effort="1" velocity="1"/>'
URDF = f"""<?xml version="1.0"?>
<robot name="two">
  <link name="base">{BALL}</link><link name="arm">{BALL}</link><link name="grip">{BALL}</link>
  <joint name="arm_j" type="revolute"><parent link="base"/><child link="arm"/>
    <origin xyz="0 0 1"/><axis xyz="0 0 1"/>{LIMIT}</joint>
  <joint name="grip_j" type="prismatic"><parent link="arm"/><child link="grip"/>
    <origin xyz="1 0 0"/><axis xyz="0 0 1"/>{LIMIT}</joint>
</robot>"""
SCENE = """
version: 1
sources:
  - {name: table}
robots:
  - name: two
    urdf: {topic: /robot_description}
    base: {topic: /odom}
    filter_adjacent: true
frames:
  - {name: top, source: table}
geometries:
  - {name: top, source: table, frame: top, shape: {type: box, size: [0.1, 0.1, 0.1]}}
  - {name: tag, source: two, frame: grip, shape: {type: box, size: [0.1, 0.1, 0.1]}}
cameras:
  - {name: head, source: two, frame: arm, size: [8, 8], fov_y: 1.0}
collision_filters:
  - {between: [[two/grip], [table]]}
"""
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def latched(client, kind, topic, *messages):
    """Publish messages that those get, too, who come later."""
    publisher = client.node.create_publisher(kind, topic, LATCHED)
    for message in messages:
        publisher.publish(message)
    return publisher


def place(client, name):
    """Return the pose of a frame in the world, None where there is none."""
    answer = client.call("GetPoseInWorld", frames=[name])
    if answer.status.code == Status.UNKNOWN_NAME:
        return None
    assert answer.status.code == 0, answer.status
    p = answer.poses[0].position
    return pytest.approx((p.x, p.y, p.z), abs=1e-9)


@pytest.fixture(scope="module")
def node(start_node, client, tmp_path_factory):
    """A node whose robot is not described yet, and whose table was placed before it came."""
    scene = tmp_path_factory.mktemp("scene") / "scene.yaml"
    scene.write_text(SCENE)
    hour = 3600 * 10**9
    before = stamp_to_msg(stamp_from_msg(client.now()) - hour)
    X = pose_from_xyz_rpy((0.0, 5.0, 0.0))
    message = multi_dof_joint_state_to_msg(["top"], X[None], stamp_ns=0, frame_id="world")
    message.header.stamp = before
    publisher = latched(client, MultiDOFJointState, "/table/poses", message)
    node = start_node({"scene": scene, "diagnostics_rate": 20.0, "max_pose_age": 600.0})
    node.table = publisher
    return node


def test_what_was_published_once_and_latched_is_heard(client, node):
    """However old its stamp is: who sends once does not get stale. It counts once."""
    wait_until(lambda: place(client, "table/top") == (0.0, 5.0, 0.0), "the table")
    diagnostics = client.listen(DiagnosticArray, "/diagnostics")
    message = diagnostics.wait_for_newest(lambda m: True, "diagnostics")
    values = diagnostics_values(message, "source table")
    assert (values["messages received"], values["dropped"]) == ("1", "0")
    X = pose_from_xyz_rpy((0.0, 6.0, 0.0))
    again = multi_dof_joint_state_to_msg(["top"], X[None], stamp_ns=0, frame_id="world")
    again.header.stamp = client.now()
    node.table.publish(again)
    wait_until(lambda: place(client, "table/top") == (0.0, 6.0, 0.0), "the table, elsewhere")

    def received(message):
        return diagnostics_values(message, "source table")["messages received"]

    message = diagnostics.wait_for_newest(lambda m: received(m) != "1", "diagnostics")
    assert received(message) == "2"


@pytest.fixture(scope="module")
def description(client, node):
    """The robot is described, after the node has begun."""
    assert place(client, "two/arm") is None
    publisher = latched(client, String, "/robot_description", String(data=URDF))
    wait_until(lambda: place(client, "two/arm") == (0.0, 0.0, 1.0), "the robot")
    return publisher


def test_what_the_scene_has_on_a_robot_comes_with_it(client, description):
    """Geometry and cameras on its links, and filters that name it."""
    scene = client.call("DescribeScene")
    assert any(geometry.geometry.name.endswith("tag") for geometry in scene.geometries)

    def camera():
        effects = client.call("ListEffects").effects
        return next((effect for effect in effects if effect.name == "camera head"), None)

    wait_until(camera, "the camera among the effects")
    wait_until(lambda: camera().is_on, "the camera, on")
    # The effect is on before its topics are advertised, in the same update.
    own = {f"/scene_graph/cameras/head/{name}" for name in ("pose", "color/image", "depth/image")}
    wait_until(lambda: own <= client.topics(), "the topics of the camera")


@pytest.fixture(scope="module")
def senders(client, description):
    """Publishers of positions and of odometry."""
    joints = client.publisher(JointState, "/joint_states")
    base = client.publisher(Odometry, "/odom")

    def send(stamp, *, x=None, **positions):
        if positions:
            message = JointState(name=list(positions), position=list(positions.values()))
            message.header.stamp = stamp_to_msg(stamp)
            joints.publish(message)
        if x is not None:
            message = Odometry(child_frame_id="base")
            message.header.frame_id, message.header.stamp = "odom", stamp_to_msg(stamp)
            message.pose.pose.position.x = x
            base.publish(message)

    return send


def test_drivers_with_skewed_stamps_move_a_robot_on_a_moving_base(client, senders):
    """The arm's stamps are 20 ms behind the gripper's, the base's 50 ms."""
    for k in range(1, 11):
        now = stamp_from_msg(client.now())
        senders(now, grip_j=0.05 * k)
        senders(now - 20_000_000, arm_j=0.1 * k)
        senders(now - 50_000_000, x=0.2 * k)
        oldest = stamp_to_msg(now - 50_000_000)
        options = QueryOptions(minimal_stamp=oldest, minimal_stamp_sources=["two"])
        options.timeout.sec = 20
        answer = client.call("GetPoseInWorld", frames=["two/grip"], options=options)
        assert answer.status.code == 0, answer.status
        p = answer.poses[0].position
        c, s = math.cos(0.1 * k), math.sin(0.1 * k)
        assert (p.x, p.y, p.z) == pytest.approx((0.2 * k + c, s, 1 + 0.05 * k), abs=1e-12)


def test_diagnostics_have_age_and_rate_of_each_joint(client, senders):
    """A joint that nobody speaks of is told from those that are heard."""
    senders(stamp_from_msg(client.now()), arm_j=0.5)
    diagnostics = client.listen(DiagnosticArray, "/diagnostics")

    def told(message):
        values = diagnostics_values(message, "source two")
        return {n: values.get(n, "") for n in ("joint arm_j", "joint grip_j", "base")}

    message = diagnostics.wait_for_newest(lambda m: "Hz" in told(m)["joint arm_j"], "a rate")
    assert told(message)["joint grip_j"].endswith("Hz")
    assert told(message)["base"].endswith(" s")


def test_a_request_that_waits_names_what_is_silent(client, senders):
    """Of the gripper's link there is nothing as new as the arm."""
    now = client.now()
    senders(stamp_from_msg(now), arm_j=0.5)
    options = QueryOptions(minimal_stamp=now, minimal_stamp_sources=["two/grip"])
    options.timeout.nanosec = 50_000_000
    answer = client.call("GetPoseInWorld", frames=["two/grip"], options=options)
    assert answer.status.code == Status.STALE
    assert "'two/grip'" in answer.status.message
    options = QueryOptions(minimal_stamp=now, minimal_stamp_sources=["two/arm_j"])
    options.timeout.sec = 20
    assert client.call("GetPoseInWorld", options=options).status.code == Status.OK
    options = QueryOptions(minimal_stamp=now, minimal_stamp_sources=["two/grip_j"])
    answer = client.call("GetPoseInWorld", options=options)
    assert answer.status.code == Status.STALE
    assert "'two/grip_j'" in answer.status.message


def test_a_robot_becomes_what_it_is_described_as_next(client, description, senders):
    """Positions hold, also of the base; a description that can't be used changes nothing."""
    senders(stamp_from_msg(client.now()), x=2.0, arm_j=0.0, grip_j=0.25)
    wait_until(lambda: place(client, "two/grip") == (3.0, 0.0, 1.25), "a pose")
    version = client.call("DescribeScene").scene_version
    diagnostics = client.listen(DiagnosticArray, "/diagnostics")

    def told(message):
        (entry,) = (s for s in message.status if s.name.endswith("source two descriptions"))
        return entry

    description.publish(String(data=URDF.replace('origin xyz="0 0 1"', 'origin xyz="0 0 high"')))
    message = diagnostics.wait_for_newest(lambda m: "not used" in told(m).message, "the failure")
    assert told(message).level == DiagnosticStatus.WARN
    assert "origin.xyz: expected a number" in told(message).message
    assert client.call("DescribeScene").scene_version == version
    description.publish(String(data=URDF.replace('origin xyz="0 0 1"', 'origin xyz="0 0 2"')))
    wait_until(lambda: place(client, "two/grip") == (3.0, 0.0, 2.25), "the robot, higher")
    diagnostics.wait_for_newest(lambda m: "not used" not in told(m).message, "no failure")
    assert client.call("DescribeScene").scene_version > version
    senders(stamp_from_msg(client.now()), arm_j=math.pi / 2)
    wait_until(lambda: place(client, "two/grip") == (2.0, 1.0, 2.25), "a pose")
