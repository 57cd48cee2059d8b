"""What moves a robot: joint states of several senders, its base, planar and floating joints."""

from __future__ import annotations

import math

from geometry_msgs.msg import Quaternion, Transform, TransformStamped, Vector3
import numpy as np
import pytest
from robot_inputs import FREE, MS, NOW, ODOMETRY, odometry, Robot, TWO
from sensor_msgs.msg import JointState, MultiDOFJointState
from tf_messages import tf_message_class

from msg_adapters.poses import multi_dof_joint_state_to_msg
from msg_adapters.stamps import stamp_to_msg
from scene_graph_ros.geometry.spatial.poses import pose_from_xyz_rpy
from scene_graph_ros.node.services.waiting import PoseRequirement
from scene_graph_ros.node.world.faults import Fault
from scene_graph_ros.node.world.inputs import (
    BASE_POSES,
    JOINT_POSES,
    POSES,
)
from scene_graph_ros.node.world.intake import UNSTAMPED
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


# TF.


def transforms(*rows):
    """Return a message of (child, parent, x, stamp)."""
    message = tf_message_class()()
    for child, parent, x, stamp in rows:
        one = TransformStamped(child_frame_id=child)
        one.header.frame_id, one.header.stamp = parent, stamp_to_msg(stamp)
        one.transform = Transform(translation=Vector3(x=x), rotation=Quaternion(w=1.0))
        message.transforms.append(one)
    return message


TF_BASE = "    base: {{tf: [map, {}base]{}}}\n"


@pytest.mark.parametrize(
    ("more", "x", "stamp"),
    [
        ("", 1.0 + 15.0 + 0.25, NOW - 10 * MS),
        (", composition: newest", 1.0 + 20.25, NOW - 10 * MS),
    ],
)
@pytest.mark.parametrize("slash", ["", "/"])
def test_a_base_by_tf_is_composed_of_moving_and_static_transforms(tmp_path, more, x, stamp, slash):
    """Odom in map is of 10 ms ago, half way between two samples of footprint in odom."""
    tf_message_class()
    robot = Robot(tmp_path, TWO, keys=TF_BASE.format(slash, more))
    static = transforms((f"{slash}base", "footprint", 0.25, NOW - 3600 * 1000 * MS))
    assert not robot.send(BASE_POSES, static, is_static=True)
    assert not robot.send(BASE_POSES, transforms(("footprint", "odom", 10.0, NOW - 20 * MS)))
    (missing,) = robot.channel(BASE_POSES).missing.values()
    assert "'base' hangs on 'odom', which no transform places in anything" in missing
    # Of 20 ms ago this one is not known: with interpolation nothing is placed before the next.
    robot.send(BASE_POSES, transforms((f"{slash}odom", f"{slash}map", 1.0, stamp)))
    assert robot.send(BASE_POSES, transforms(("footprint", "odom", 20.0, NOW)))
    assert not robot.channel(BASE_POSES).missing
    np.testing.assert_allclose(robot.where("base")[:3, 3], [x, 0, 0], atol=1e-12)
    robot.joints(NOW, arm_j=math.pi / 2, grip_j=0.0)
    np.testing.assert_allclose(robot.where("hand")[:3, 3], [x, 1, 0], atol=1e-12)
    assert robot.world.snapshot.frame_stamp("r/base") == stamp
    assert robot.world.snapshot.source_stamp("r") == stamp
    assert not robot.faults(BASE_POSES)


def test_a_base_by_static_transforms_alone_never_gets_old(tmp_path):
    """It is where they put it, and holds no request up."""
    tf_message_class()
    robot = Robot(tmp_path, TWO, keys=TF_BASE.format("", ""))
    rows = ("base", "odom", 2.0, 1), ("odom", "map", 1.0, 1)
    assert robot.send(BASE_POSES, transforms(*rows), is_static=True)
    np.testing.assert_array_equal(robot.where("base")[:3, 3], [3, 0, 0])
    assert robot.world.snapshot.frame_stamp("r/base") == STATIC
    robot.joints(NOW, arm_j=0.0, grip_j=0.0)
    assert robot.world.snapshot.source_stamp("r") == NOW


# As the planner has it.


@pytest.mark.parametrize("virtual", ["", "planar", "floating"])
def test_what_poses_move_is_where_the_planner_has_it(tmp_path, virtual):
    """Planar and floating joints, and a virtual joint under them: links of both are the same."""
    srdf = (
        f'<robot name="free"><virtual_joint name="world_joint" type="{virtual}"'
        ' parent_frame="/odom" child_link="base"/></robot>'
        if virtual
        else ""
    )
    robot = Robot(tmp_path, FREE, srdf=srdf)
    rng = np.random.default_rng(3)
    for k in range(5):
        x, y, yaw = rng.uniform(-1.0, 1.0, 3)
        flat = pose_from_xyz_rpy((x, y, 0.0), (0.0, 0.0, yaw))
        free = pose_from_xyz_rpy(rng.uniform(-1.0, 1.0, 3), rng.uniform(-3.0, 3.0, 3))
        poses = {"cart_j": flat, "/drone_j": free}
        if virtual:
            poses["world_joint"] = free if virtual == "floating" else flat
        message = multi_dof_joint_state_to_msg(
            list(poses), np.stack(list(poses.values())), stamp_ns=NOW + k, frame_id=""
        )
        assert robot.send(JOINT_POSES, message)
        snapshot = robot.world.snapshot
        planning = snapshot.robots.planning(snapshot.query.snapshot, snapshot.bases)
        q = planning.present(snapshot.positions)
        links = ("base", "cart", "drone")
        X_WL = planning.tree.link_poses(q, [f"r/{link}" for link in links])
        for link, X in zip(links, X_WL, strict=True):
            np.testing.assert_allclose(robot.where(link), X, atol=1e-12)
    assert not robot.faults(JOINT_POSES)
    X_WB = (free if virtual == "floating" else flat) if virtual else np.eye(4)
    np.testing.assert_allclose(robot.where("base"), X_WB, atol=1e-12)
    np.testing.assert_allclose(robot.where("cart"), X_WB @ flat, atol=1e-12)
