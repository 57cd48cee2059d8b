"""Trajectories and limits of motion as messages, and back."""

from builtin_interfaces.msg import Duration
import numpy as np
import pytest
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from msg_adapters.errors import MessageError
from msg_adapters.robot_configurations import RobotNames
from msg_adapters.trajectories import (
    joint_trajectory_from_msg,
    joint_trajectory_to_msg,
    motion_limits_from_msg,
    rise_time_from_msg,
)
from scene_graph_msgs.msg import MotionLimits
from scene_graph_ros.geometry.errors import UnknownIdError
from scene_graph_ros.planning.trajectories import TrajectoryError, TrajectoryPoints
from scene_graph_ros.robots.kinematic_tree import KinematicTree
from scene_graph_ros.robots.tree_joint import TreeJoint
from scene_graph_ros.robots.tree_kernels import PRISMATIC

TIMES = np.array([0, 1, 1_234_567_891, 2_147_483_647_999_999_999])
RNG = np.random.default_rng(0)
ROWS = RNG.normal(size=(3, 4, 2))


def points(count):
    """Return points with positions, velocities and accelerations, or less of these."""
    return TrajectoryPoints(TIMES, *ROWS[:count])


@pytest.mark.parametrize("count", [1, 2, 3])
def test_a_trajectory_comes_back_bit_for_bit(count):
    """Names, times to the nanosecond, and every number; what is not there stays so."""
    message = joint_trajectory_to_msg(("b", "a"), points(count))
    assert message.points[2].time_from_start == Duration(sec=1, nanosec=234_567_891)
    assert (message.header.stamp.sec, message.header.stamp.nanosec) == (0, 0)
    names, back = joint_trajectory_from_msg(message)
    assert names == ("b", "a")
    np.testing.assert_array_equal(back.nanoseconds, TIMES)
    for number, name in enumerate(("positions", "velocities", "accelerations")):
        found = getattr(back, name)
        if number < count:
            np.testing.assert_array_equal(found, ROWS[number])
        else:
            assert found is None


def test_times_that_a_message_can_t_hold_are_refused():
    """A second more than 32 bits of seconds have."""
    late = TrajectoryPoints(np.array([0, TIMES[-1] + 1]), ROWS[0, :2])
    with pytest.raises(OverflowError):
        joint_trajectory_to_msg(("b", "a"), late)


@pytest.mark.parametrize(
    ("change", "error", "words"),
    [
        (lambda m: m.points.clear(), MessageError, "points is empty"),
        (lambda m: m.points[1].positions.pop(), MessageError, r"points\[1\].positions has 1 num"),
        (
            lambda m: setattr(m.points[2], "velocities", []),
            MessageError,
            r"points\[2\].velocities has 0",
        ),
        (
            lambda m: setattr(m.points[0], "velocities", []),
            MessageError,
            r"points\[1\].velocities has 2 numbers for 2 joints; 0 of 1 points before",
        ),
        (lambda m: m.points[1].effort.append(1.0), MessageError, r"points\[1\] has efforts"),
        (
            lambda m: setattr(m.points[1], "time_from_start", Duration()),
            TrajectoryError,
            "times must grow",
        ),
        (
            lambda m: m.points[1].positions.__setitem__(0, float("nan")),
            TrajectoryError,
            r"positions\[1, 0\] must be finite",
        ),
    ],
)
def test_a_trajectory_that_does_not_fit_is_refused(change, error, words):
    """By field, row and number."""
    message = joint_trajectory_to_msg(("b", "a"), points(2))
    change(message)
    with pytest.raises(error, match=words):
        joint_trajectory_from_msg(message)


def test_a_trajectory_of_others_is_read():
    """Lists of positions alone, as a program writes them."""
    message = JointTrajectory(joint_names=["x"])
    message.points = [
        JointTrajectoryPoint(positions=[float(k)], time_from_start=Duration(sec=k))
        for k in range(3)
    ]
    names, found = joint_trajectory_from_msg(message)
    assert names == ("x",)
    np.testing.assert_array_equal(found.trajectory().value([0.5, 1.5]), [[0.5], [1.5]])


def tree():
    """Return two robots' rails; the first one's URDF says how fast it is."""
    joints = [
        TreeJoint("one/rail", PRISMATIC, 0, np.eye(4), velocity=2.0),
        TreeJoint("two/rail", PRISMATIC, 0, np.eye(4)),
        TreeJoint("two/lift", PRISMATIC, 2, np.eye(4)),
    ]
    return KinematicTree("two", tuple(joints), ("a",), (1,), np.eye(4)[np.newaxis])


def read(positions=(0, 2), **fields):
    """Return the limits that a message says."""
    names = RobotNames("position", tree().position_names, ("one", "two"))
    rows = np.array(positions, dtype=np.intp)
    return motion_limits_from_msg(MotionLimits(**fields), names, tree(), rows, "limits")


def test_limits_are_those_of_the_urdf_unless_they_are_named():
    """Scaled, and of the positions that move."""
    found = read(
        names=["lift", "one/rail"],
        max_velocities=[3.0, 1.0],
        max_accelerations=[5.0, 6.0],
        velocity_scaling=0.5,
        acceleration_scaling=0.25,
    )
    assert found.names == ("one/rail", "two/lift")
    np.testing.assert_array_equal(found.velocities, [0.5, 1.5])
    np.testing.assert_array_equal(found.accelerations, [1.5, 1.25])
    own = read((0,), max_acceleration=4.0)
    np.testing.assert_array_equal(own.velocities, [2.0])
    np.testing.assert_array_equal(own.accelerations, [4.0])
    mixed = read(names=["lift"], max_velocities=[3.0], max_acceleration=4.0)
    np.testing.assert_array_equal(mixed.accelerations, [4.0, 4.0])
    assert mixed.jerks is None


def test_jerks_are_limited_where_something_says_so():
    """By name, or one for all others; scalings have nothing to do with them."""
    fields = {"names": ["lift"], "max_velocities": [3.0], "max_acceleration": 4.0}
    every = read(**fields, max_jerk=20.0, acceleration_scaling=0.5)
    np.testing.assert_array_equal(every.jerks, [20.0, 20.0])
    mixed = read(**fields, max_jerks=[30.0], max_jerk=20.0)
    np.testing.assert_array_equal(mixed.jerks, [20.0, 30.0])


@pytest.mark.parametrize(
    ("fields", "error", "words"),
    [
        ({}, TrajectoryError, "'two/lift' has no limit of velocity"),
        ({"names": ["lift"], "max_velocities": [1.0]}, TrajectoryError, "no limit of acceler"),
        ({"names": ["lfit"]}, UnknownIdError, "limits.names: no robot has a position 'lfit'"),
        (
            {"names": ["lift", "/two/lift"], "max_velocities": [1.0, 2.0]},
            MessageError,
            "limits.max_velocities has 'two/lift' twice, with 1 and 2",
        ),
        ({"names": ["lift"], "max_velocities": [1.0, 2.0]}, MessageError, "2 numbers for 1 names"),
        (
            {"names": ["lift"], "max_velocities": [0.0], "max_acceleration": 1.0},
            TrajectoryError,
            "velocities of 'two/lift' must be from 1e-12 to 1e\\+18, not 0",
        ),
        (
            {
                "names": ["lift"],
                "max_velocities": [1.0],
                "max_acceleration": 1.0,
                "velocity_scaling": 5e-324,
            },
            TrajectoryError,
            "limit of velocities of .* must be from 1e-12 to",
        ),
        (
            {"names": ["lift"], "max_velocities": [1.0], "max_acceleration": -1.0},
            TrajectoryError,
            "accelerations of 'one/rail' must be from 1e-12 to",
        ),
        (
            {
                "names": ["lift"],
                "max_velocities": [1.0],
                "max_acceleration": 1.0,
                "max_jerks": [1.0],
            },
            TrajectoryError,
            "'one/rail' has no limit of jerk",
        ),
        (
            {
                "names": ["lift"],
                "max_velocities": [1.0],
                "max_acceleration": 1.0,
                "max_jerk": -1.0,
            },
            TrajectoryError,
            "jerks of 'one/rail' must be from 1e-12 to",
        ),
        (
            {"names": ["lift"], "max_velocities": [1.0], "velocity_scaling": 0.0},
            TrajectoryError,
            "velocity_scaling must be in",
        ),
    ],
)
def test_limits_that_mean_nothing_are_refused_by_name(fields, error, words):
    """With the value."""
    with pytest.raises(error, match=words):
        read(**fields)


def test_a_rise_time_is_no_less_than_none():
    """In seconds."""
    assert rise_time_from_msg(Duration(nanosec=250_000_000), "rise_time") == 0.25
    with pytest.raises(MessageError, match="rise_time is negative: -1 s"):
        rise_time_from_msg(Duration(sec=-1), "rise_time")
