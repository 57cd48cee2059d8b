"""Configurations by names: of joints that mimic others, said twice, and with leading slashes."""

from __future__ import annotations

import numpy as np
import pytest

from msg_adapters.errors import MessageError
from msg_adapters.robot_configurations import (
    AS_ONE,
    configurations_from_msg,
    Meaning,
    RobotNames,
)
from msg_adapters.trajectories import motion_limits_from_msg
from scene_graph_msgs.msg import MotionLimits, RobotConfigurations
from scene_graph_ros.geometry.errors import NameConflictError, UnknownIdError
from scene_graph_ros.robots.kinematic_tree import KinematicTree
from scene_graph_ros.robots.tree_joint import TreeJoint
from scene_graph_ros.robots.tree_kernels import PRISMATIC

POSITIONS = ("r/finger_1", "r/arm", "s/arm")
FOLLOWERS = {
    "r/finger_2": Meaning("r/finger_2", 0, False, 1.0, 0.0),
    "r/thumb": Meaning("r/thumb", 0, False, -2.0, 0.5),
    "r/still": Meaning("r/still", 0, False, 0.0, 0.25),
}
NAMES = RobotNames("position", POSITIONS, ["r", "s"], FOLLOWERS)
PRESENT = np.array([0.01, 0.2, 0.3])


def read(**rows):
    """Return configurations of names and values."""
    names = [name.replace("__", "/") for name in rows]
    values = np.array(list(rows.values()), dtype=np.float64).T.reshape(-1)
    message = RobotConfigurations(names=names, positions=values.tolist())
    return configurations_from_msg(message, NAMES, PRESENT, "goals")


@pytest.mark.parametrize(
    ("rows", "finger"),
    [
        ({"finger_1": [0.04]}, 0.04),
        ({"finger_2": [0.04]}, 0.04),
        ({"r__finger_2": [0.04]}, 0.04),
        # At -2 q + 0.5: q is (0.5 - value) / 2.
        ({"thumb": [0.42]}, 0.04),
        ({"still": [0.25]}, 0.01),
        ({"finger_2": [0.0401], "finger_1": [0.04]}, 0.04),
        ({"finger_1": [0.04], "finger_2": [0.0401]}, 0.04),
        ({"thumb": [0.42], "finger_2": [0.04]}, 0.04),
        ({"finger_1": [0.04], "__finger_1": [0.04], "r__finger_1": [0.04]}, 0.04),
    ],
)
def test_joints_that_mimic_say_where_their_leader_is(rows, finger):
    """All that is said counts where it agrees; a joint's own position comes first."""
    (q,) = read(**rows)
    np.testing.assert_allclose(q, [finger, 0.2, 0.3], rtol=0.0, atol=1e-15)


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ({"finger_1": [0.04], "finger_2": [0.02]}, "'finger_2' is at 0.02 .* puts it at 0.04"),
        ({"finger_1": [0.04], "thumb": [0.5]}, "'thumb' is at 0.5 .* puts it at 0.42"),
        ({"finger_2": [0.04], "thumb": [0.5]}, "'thumb' is at 0.5 .* puts it at 0.42"),
        ({"still": [0.0]}, "'still' is at 0 .* puts it at 0.25"),
        ({"finger_1": [0.0, 0.0], "__finger_1": [0.0, 1e-9]}, "1e-09 in row 1 .* puts it at 0"),
        (
            {"finger_1": [0.04], "finger_2": [0.04 + 1.01 * AS_ONE]},
            "'finger_2' is at 0.04101 in row 0 of positions",
        ),
    ],
)
def test_what_contradicts_itself_is_refused_with_both_values(rows, words):
    """The name, the row, and where what else is said puts it."""
    with pytest.raises(MessageError, match=f"goals: {words}" if words[0] == "'" else words):
        read(**rows)


def test_names_that_nobody_has_or_several_are_refused():
    """With a slash before them, too."""
    with pytest.raises(UnknownIdError, match=r"goals\.names: no robot has a position 'finger_3'"):
        read(__finger_3=[0.0])
    with pytest.raises(NameConflictError, match="'arm' is ambiguous: r/arm, s/arm"):
        read(__arm=[0.0])
    assert read(__s__arm=[0.5])[0, 2] == 0.5


def test_limits_of_a_joint_that_mimics_are_its_leaders():
    """Twice as fast as its leader it may be 1 m/s, so the leader 0.5; the narrowest holds."""
    joint = TreeJoint("r/finger_1", PRISMATIC, 0, np.eye(4))
    tree = KinematicTree("two", (joint,), ("a",), (1,), np.eye(4)[np.newaxis])
    names = RobotNames("position", ("r/finger_1",), ["r"], FOLLOWERS)
    message = MotionLimits(
        names=["finger_1", "thumb", "still"],
        max_velocities=[3.0, 1.0, 0.1],
        max_accelerations=[1.0, 4.0, 0.1],
    )
    found = motion_limits_from_msg(message, names, tree, np.array([0]), "limits")
    np.testing.assert_array_equal(found.velocities, [0.5])
    np.testing.assert_array_equal(found.accelerations, [1.0])
