"""What moves a robot: joint states of several senders, its base, planar and floating joints."""

from __future__ import annotations

import math

from geometry_msgs.msg import Quaternion, Transform, Vector3
import numpy as np
import pytest
from robot_inputs import FREE, MS, NOW, ODOMETRY, odometry, Robot, TWO
from sensor_msgs.msg import JointState, MultiDOFJointState

from msg_adapters.stamps import stamp_to_msg
from scene_graph_ros.node.services.waiting import PoseRequirement
from scene_graph_ros.node.world.inputs import (
    BASE_POSES,
    JOINT_POSES,
    POSES,
)
from scene_graph_ros.node.world.intake import Fault, UNSTAMPED
from scene_graph_ros.node.world.world import STATIC


@pytest.fixture
def two(tmp_path):
    """An arm with a gripper, each of which has a driver."""
    return Robot(tmp_path, TWO)


def test_a_driver_whose_stamps_lag_behind_another_moves_its_joints(two):
    """Stamps are compared joint by joint: 20 ms behind the gripper's the arm moves."""
    for k in range(5):
        assert two.joints(NOW + 20 * k * MS, grip_j=0.1 * k)
        assert two.joints(NOW + 20 * (k - 1) * MS, arm_j=0.2 * k)
    assert not two.faults()
    np.testing.assert_allclose(two.where("hand")[:2, 3], [math.cos(0.8), math.sin(0.8)])


def test_of_a_late_message_what_is_newer_than_before_still_counts(two):
    """A whole message that is older than one of the joints has a say about the others."""
    two.joints(NOW, arm_j=1.0)
    assert two.joints(NOW - 5 * MS, arm_j=0.5, grip_j=0.25)
    assert two.positions == pytest.approx({"arm_j": 1.0, "grip_j": 0.25, "other_j": -0.25})
    assert two.faults() == {Fault.OUT_OF_ORDER: 1}
    assert "joint 'arm_j'" in two.warnings[0]
    assert "0.005 s before" in two.warnings[0]


def test_a_link_is_as_old_as_the_oldest_joint_that_moves_it(two):
    """The gripper's link depends on both joints, the arm's on one, the base on none."""
    snapshot = lambda: two.world.snapshot  # noqa: E731
    assert snapshot().source_stamp("r") == UNSTAMPED
    two.joints(NOW, grip_j=0.1)
    assert snapshot().frame_stamp("r/base") == STATIC
    assert snapshot().frame_stamp("r/grip") == UNSTAMPED
    assert snapshot().stamp == NOW
    two.joints(NOW - 9 * MS, arm_j=0.1)
    stamps = {link: snapshot().frame_stamp(f"r/{link}") for link in ("arm", "hand", "grip")}
    assert stamps == dict.fromkeys(stamps, NOW - 9 * MS)
    assert snapshot().source_stamp("r") == NOW - 9 * MS
    two.joints(NOW + 3 * MS, arm_j=0.1)
    assert snapshot().frame_stamp("r/grip") == NOW
    assert snapshot().frame_stamp("r/arm") == NOW + 3 * MS


def test_waiting_for_a_robot_waits_for_its_slowest_joint(two):
    """Poses as new as a stamp: of the robot, or of a link alone."""
    two.joints(NOW, arm_j=0.1)
    snapshot = two.world.snapshot
    assert not PoseRequirement(NOW, ("r",), 0.0).is_met(snapshot)
    assert PoseRequirement(NOW, ("r/hand",), 0.0).is_met(snapshot)
    assert not PoseRequirement(NOW, ("r/grip",), 0.0).is_met(snapshot)
    assert PoseRequirement(NOW, ("r/base",), 0.0).is_met(snapshot)
    two.joints(NOW, grip_j=0.1)
    assert PoseRequirement(NOW, ("r",), 0.0).is_met(two.world.snapshot)


def test_a_follower_keeps_what_was_measured_later(two):
    """A joint that mimics follows its leader, unless it has a newer position of its own."""
    two.joints(NOW, grip_j=0.2)
    assert two.positions["other_j"] == -0.2
    two.joints(NOW + 2 * MS, other_j=-0.3)
    two.joints(NOW + 1 * MS, grip_j=0.25)
    assert two.positions["other_j"] == -0.3
    two.joints(NOW + 3 * MS, grip_j=0.4)
    assert two.positions["other_j"] == -0.4


def test_a_static_joint_never_gets_old(two):
    """A position of who sends once is taken however old it is, and holds nothing up."""
    hour = 3600 * 10**9
    assert not two.joints(NOW - hour, grip_j=0.5)
    assert two.faults() == {Fault.STALE: 1}
    assert two.joints(NOW - hour, is_static=True, grip_j=0.5)
    two.joints(NOW, arm_j=0.0)
    assert two.world.snapshot.frame_stamp("r/grip") == NOW


@pytest.mark.parametrize("rounds", [1, 4])
def test_a_name_that_comes_twice_counts_where_both_say_the_same(two, rounds):
    """Also with a leading slash; else neither counts, and both values are named."""
    message = JointState(name=["arm_j", "/arm_j", "grip_j", "grip_j"])
    for k in range(rounds):
        message.header.stamp = stamp_to_msg(NOW + k)
        message.position = [0.5, 0.5, 0.1, 0.2]
        assert two.send(POSES, message)
    assert two.positions == {"arm_j": 0.5, "grip_j": 0.0, "other_j": 0.0}
    assert two.faults() == {Fault.CONTRADICTORY: rounds}
    (warning,) = two.warnings
    assert "'grip_j'" in warning
    assert "0.1" in warning
    assert "0.2" in warning


def test_positions_that_place_a_link_nowhere_are_not_remembered(two):
    """What is refused leaves the joint where it was, also for the next message."""
    two.joints(NOW, arm_j=0.0, grip_j=0.25)
    two.record.robot.kinematics  # noqa: B018
    before = two.where("grip").copy()
    assert not two.joints(NOW + MS, grip_j=math.inf)
    two.joints(NOW + 2 * MS, arm_j=0.0)
    np.testing.assert_array_equal(two.where("grip"), before)


def test_stamps_of_joints_are_forgotten_with_the_clock(two):
    """After the clock jumped back earlier positions count again."""
    two.joints(NOW, arm_j=0.5, grip_j=0.5)
    two.world.forget_stamps(NOW - 1)
    assert two.world.snapshot.source_stamp("r") == UNSTAMPED
    assert two.joints(NOW - MS, arm_j=0.25, grip_j=0.5)
    assert two.positions["arm_j"] == 0.25


def test_odometry_moves_a_robot(tmp_path):
    """All links go along; joints turn in the base's frame, and the base has a stamp of its own."""
    robot = Robot(tmp_path, TWO, keys=ODOMETRY)
    robot.joints(NOW, arm_j=math.pi / 2, grip_j=0.0)
    assert robot.world.snapshot.source_stamp("r") == UNSTAMPED
    assert robot.send(BASE_POSES, odometry(NOW - MS, 2.0, yaw=math.pi / 2))
    np.testing.assert_allclose(robot.where("base")[:3, 3], [2, 0, 0], atol=1e-15)
    np.testing.assert_allclose(robot.where("hand")[:3, 3], [1, 0, 0], atol=1e-15)
    assert robot.world.snapshot.source_stamp("r") == NOW - MS
    np.testing.assert_array_equal(robot.world.snapshot.bases["r"][:3, 3], [2, 0, 0])
    assert not robot.send(BASE_POSES, odometry(NOW - 2 * MS, 3.0))
    assert robot.faults(BASE_POSES) == {Fault.OUT_OF_ORDER: 1}


@pytest.mark.parametrize(
    ("names", "fault", "words"),
    [
        ({"parent": "map"}, Fault.WRONG_PARENT, "given in 'map', not in 'odom'"),
        ({"child": "arm"}, Fault.UNKNOWN_FRAME, "joints move"),
        ({"child": "wheel"}, Fault.UNKNOWN_FRAME, "no link of the robot"),
    ],
)
def test_odometry_of_something_else_moves_nothing(tmp_path, names, fault, words):
    """It is counted, and the sentence says what would have to be different."""
    robot = Robot(tmp_path, TWO, keys=ODOMETRY)
    assert not robot.send(BASE_POSES, odometry(NOW, 2.0, **names))
    assert robot.faults(BASE_POSES) == {fault: 1}
    assert words in robot.warnings[0]


def multi_dof(stamp, name, x=0.0, z=0.0, parent=""):
    """Return the pose of a joint."""
    at = Transform(translation=Vector3(x=x, z=z), rotation=Quaternion(w=1.0))
    message = MultiDOFJointState(joint_names=[name], transforms=[at])
    message.header.stamp, message.header.frame_id = stamp_to_msg(stamp), parent
    return message


def test_planar_and_floating_joints_move_by_their_poses(tmp_path):
    """From where they are at rest; a planar one does not leave its plane."""
    robot = Robot(tmp_path, FREE)
    assert robot.send(JOINT_POSES, multi_dof(NOW, "cart_j", 0.5))
    assert robot.send(JOINT_POSES, multi_dof(NOW, "drone_j", 0.25, 1.0))
    np.testing.assert_allclose(robot.where("cart")[:3, 3], [0.5, 0, 0], atol=1e-15)
    np.testing.assert_allclose(robot.where("drone")[:3, 3], [0.25, 0, 3], atol=1e-15)
    assert not robot.send(JOINT_POSES, multi_dof(NOW + 1, "cart_j", 0.75, 0.1))
    assert "leaves the plane by 0.1 m" in robot.warnings[0]
    np.testing.assert_allclose(robot.where("cart")[:3, 3], [0.5, 0, 0], atol=1e-15)
    q = robot.world.snapshot.positions["r"]
    np.testing.assert_allclose(q, [0.5, 0, 0, 1, 0, 0, 0, 0.25, 0, 1])


def test_a_virtual_joint_moves_the_base(tmp_path):
    """As the SRDF has it: planar, from the frame that it names."""
    srdf = (
        '<robot name="two"><virtual_joint name="world_joint" type="planar" parent_frame="odom"'
        ' child_link="base"/></robot>'
    )
    robot = Robot(tmp_path, TWO, srdf=srdf)
    assert robot.send(JOINT_POSES, multi_dof(NOW, "world_joint", 1.5, parent="odom"))
    np.testing.assert_allclose(robot.where("arm")[:3, 3], [1.5, 0, 0], atol=1e-15)
    assert not robot.send(JOINT_POSES, multi_dof(NOW, "world_joint", 2.0, 0.1, parent="odom"))
    assert not robot.send(JOINT_POSES, multi_dof(NOW, "world_joint", 2.0, parent="map"))
    assert robot.faults(JOINT_POSES)[Fault.WRONG_PARENT] == 1
