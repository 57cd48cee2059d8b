"""Configurations: their limits, groups of an SRDF, and what is checked of them."""

import numpy as np
import pytest
from small_trees import ARM, arm, LOOSE

from scene_graph_ros.robots import KinematicTree, KinematicTreeError
from scene_graph_ros.scene_files import load_kinematic_tree, load_srdf, load_urdf


def test_limits_of_joints_that_follow_limit_the_one_they_follow():
    """The slide may go from 0 to 0.5, but its jaw, at 0.5 - 3 q, not below -0.1: q <= 0.2."""
    tree = arm()
    np.testing.assert_allclose(tree.lower, [-np.inf, -1.0, 0.0])
    np.testing.assert_allclose(tree.upper, [np.inf, 2.0, 0.2])


def test_groups_of_an_srdf():
    """Joints, links, chains and groups in groups; those that follow have no position."""
    robot = load_urdf(ARM)
    srdf = """<robot name="arm">
      <group name="all"><group name="reach"/><group name="grip"/></group>
      <group name="reach"><chain base_link="base" tip_link="lower"/></group>
      <group name="grip"><link name="jaw"/><joint name="slide"/><joint name="none"/></group>
    </robot>"""
    semantics = load_srdf(srdf, robot)
    assert semantics.groups == {
        "all": ("shoulder", "elbow", "slide", "jaw"),
        "reach": ("shoulder", "elbow"),
        "grip": ("slide", "jaw"),
    }
    assert any("has no joint 'none'" in warning for warning in semantics.warnings)
    tree = robot.kinematic_tree(semantics)
    assert tree.group_positions("all").tolist() == [0, 1, 2]
    assert tree.group_positions("grip").tolist() == [2]
    with pytest.raises(KinematicTreeError, match="has no group 'al'; did you mean 'all'"):
        tree.group_positions("al")


@pytest.mark.parametrize(
    ("groups", "message"),
    [
        ('<group name="a"><group name="b"/></group>', "there is no group 'b'"),
        (
            '<group name="a"><group name="b"/></group><group name="b"><group name="a"/></group>',
            "group 'a' is inside itself",
        ),
        ('<group name="a"/><group name="a"/>', "another group called 'a'"),
        (
            '<group name="a"><chain base_link="tip" tip_link="jew"/></group>',
            "link 'jew'",
        ),
    ],
)
def test_groups_that_cannot_be(groups, message):
    """Are left out with a warning, as the rest of the file may serve."""
    semantics = load_srdf(f'<robot name="arm">{groups}</robot>', load_urdf(ARM))
    (warning,) = semantics.warnings
    assert message in warning and warning.startswith("<text>:1")
    assert not any(semantics.groups.values())


@pytest.mark.parametrize(
    ("q", "message"),
    [
        ([0.0, 1.0], r"must have shape \(n, 3\) or \(3,\), not \(2,\)"),
        (np.zeros((2, 2, 3)), r"not \(2, 2, 3\)"),
        ([[0.0] * 3, [0.0, np.nan, 0.0]], "'elbow' of configuration 1 must be finite, not nan"),
        (["a", "b", "c"], "q must be numbers"),
    ],
)
def test_bad_configurations_are_named(q, message):
    """With the position and its row."""
    with pytest.raises(KinematicTreeError, match=message):
        arm().link_poses(q)


@pytest.mark.parametrize(
    ("q", "is_sure"),
    [
        (np.ones((2, 3)), True),
        (np.full((1, 3), 7.0), True),
        (np.full((1, 3), 9.0), False),
        (np.full((1, 3), np.nan), False),
        (np.full((1, 3), np.inf), False),
        (np.ones((2, 2)), False),
        (np.ones(3), False),
        (np.ones((2, 3), np.float32), False),
        (np.ones((3, 2)).T, False),
        (np.ones((2, 6))[:, ::2], False),
        (np.zeros((999, 3)), False),
        ([[1.0, 1.0, 1.0]], False),
    ],
)
def test_what_is_certainly_right(q, is_sure):
    """Arrays as kernels take them, of few numbers; all others have to be looked at."""
    assert arm().is_certainly_within(q, 15.0) is is_sure


def test_quaternions_and_what_nobody_may_write_to_are_never_certain():
    """A quaternion may be zero; kernels are compiled for arrays that may be written to."""
    assert not load_kinematic_tree(LOOSE).is_certainly_within(np.ones((1, 10)), 15.0)
    q = np.ones((1, 3))
    q.setflags(write=False)
    assert not arm().is_certainly_within(q, 15.0)


def test_bad_names_points_and_quaternions():
    """Each is named with what there is."""
    tree = load_kinematic_tree(LOOSE)
    with pytest.raises(KinematicTreeError, match="joint 'free' of configuration 1 is zero"):
        tree.link_poses([tree.zero_configuration(), np.zeros(10)])
    with pytest.raises(KinematicTreeError, match="has no link 'tpi'; did you mean 'tip'"):
        arm().link_poses(np.zeros(3), ["tpi"])
    with pytest.raises(KinematicTreeError, match="p_LQ must be three finite numbers"):
        arm().jacobians(np.zeros(3), "tip", [0.0, np.inf, 0.0])
    with pytest.raises(KinematicTreeError, match="two links 'a'"):
        KinematicTree("twins", (), ("a", "a"), (0, 0), np.tile(np.eye(4), (2, 1, 1)))
