"""Configurations that put tools where they are to be: poses that are reached, and why not."""

import math

import numpy as np
import pytest
from robot_scenes import BALL, diagram, DRONE, SLIDE

from scene_graph_ros.geometry.errors import InvalidPoseError
from scene_graph_ros.geometry.spatial.poses import pose_from_xyz_rpy
from scene_graph_ros.planning import (
    inverse_kinematics,
    InverseKinematicsError,
    InverseKinematicsFailure,
    load_robot_diagram,
    plan_path,
    PlanFailure,
    PoseTarget,
    SceneGraphCollisionChecker,
)
from scene_graph_ros.robots import KinematicTreeError
from scene_graph_ros.scene_files import load_kinematic_tree, resolve_resource

# Two links of 2 m and 1 m in the xy-plane; the elbow bends to one side only.
PLANAR = """<robot name="planar"><link name="base"/><link name="upper"/><link name="lower"/>
  <link name="tip"/>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
    <axis xyz="0 0 1"/><limit lower="-2" upper="2"/></joint>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/>
    <origin xyz="2 0 0"/><axis xyz="0 0 1"/><limit lower="0" upper="2.5"/></joint>
  <joint name="wrist" type="fixed"><parent link="lower"/><child link="tip"/>
    <origin xyz="1 0 0"/></joint></robot>"""

ROBOTS = "package://example-robot-data/robots"
ARMS = [
    ("panda_description/urdf/panda.urdf", "panda_hand"),
    ("ur_description/urdf/ur5_robot.urdf", "tool0"),
    ("baxter_description/urdf/baxter.urdf", "left_gripper"),
]


def at(x, y, z=0.0, **tolerances):
    """Return a target for the tip whose orientation is open."""
    return PoseTarget(
        "tip", pose_from_xyz_rpy((x, y, z)), rotation_tolerance=math.pi, **tolerances
    )


def errors(tree, q, target):
    """Return how far a tool is off, m, and by which angle, rad; by the chord, not the sine."""
    X_WT = tree.link_poses(q, [target.link])[0] @ target.X_LT
    chord = np.linalg.norm(X_WT[:3, :3] - target.X_WT[:3, :3]) / math.sqrt(2.0)
    angle = 2.0 * math.asin(min(1.0, 0.5 * chord))
    return np.linalg.norm(X_WT[:3, 3] - target.X_WT[:3, 3]), angle


@pytest.mark.parametrize(("path", "link"), ARMS)
def test_poses_that_an_arm_has_are_reached(path, link):
    """All of 20 random ones, with a tool, from zero, to 1e-9 m and rad, within limits."""
    tree = load_kinematic_tree(resolve_resource(f"{ROBOTS}/{path}"))
    rng = np.random.default_rng(4)
    lower, upper = np.maximum(tree.lower, -3.0), np.minimum(tree.upper, 3.0)
    X_LT = pose_from_xyz_rpy((0.02, -0.03, 0.1), (0.3, -0.2, 0.9))
    for q in rng.uniform(lower, upper, (20, tree.num_positions)):
        X_WT = tree.link_poses(q, [link])[0] @ X_LT
        target = PoseTarget(link, X_WT, X_LT)
        found = inverse_kinematics(tree, target)
        assert found.is_success, found.reason
        (solution,) = found.configurations
        assert ((solution >= tree.lower) & (solution <= tree.upper)).all()
        distance, angle = errors(tree, solution, target)
        assert distance <= 1e-9 and angle <= 1.01e-9
        assert found.position_error <= 1e-9 and found.rotation_error <= 1e-9


def test_both_bends_of_an_elbow_where_limits_leave_them():
    """To (2, 1) lead elbow 90 degrees, shoulder 0; and the mirrored one, beyond its limit."""
    tree = load_kinematic_tree(PLANAR)
    found = inverse_kinematics(tree, at(2.0, 1.0), solutions=5, tries=64)
    np.testing.assert_allclose(found.configurations, [[0.0, math.pi / 2]], atol=1e-9)
    free = load_kinematic_tree(PLANAR.replace('lower="0"', 'lower="-2.5"'))
    found = inverse_kinematics(free, at(2.0, 1.0), solutions=5, tries=64)
    mirrored = [2.0 * math.atan2(1.0, 2.0), -math.pi / 2]
    assert found.configurations.shape == (2, 2)
    np.testing.assert_allclose(found.configurations[0], [0.0, math.pi / 2], atol=1e-9)
    np.testing.assert_allclose(found.configurations[1], mirrored, atol=1e-9)
    near = inverse_kinematics(free, at(2.0, 1.0), near=mirrored)
    np.testing.assert_allclose(near.configurations, [mirrored], atol=1e-9)
    assert near.tries <= 32


def test_a_stretched_arm_is_reached_where_it_cannot_move_on():
    """(3, 0) is at the end of its reach, where the Jacobian has no inverse."""
    tree = load_kinematic_tree(PLANAR)
    target = at(3.0, 0.0, position_tolerance=1e-6)
    found = inverse_kinematics(tree, target, near=[0.4, 0.7])
    assert found.is_success, found.reason
    assert errors(tree, found.configurations[0], target)[0] <= 1e-6


def test_what_is_too_far_says_how_near_it_came():
    """A point at 3.5 m is half a metre beyond the arm; one at 0.4 m is too near to bend to."""
    tree = load_kinematic_tree(PLANAR)
    for target, distance in ((at(3.5, 0.0), 500.0), (at(2.0, 1.0, z=0.3), 300.0)):
        found = inverse_kinematics(tree, target, tries=64)
        assert found.failure is InverseKinematicsFailure.UNREACHED
        assert found.configurations.shape == (0, 2) and found.tries == 64
        assert 1e3 * found.position_error == pytest.approx(distance, rel=1e-6)
        assert errors(tree, found.nearest, target)[0] == pytest.approx(1e-3 * distance, rel=1e-6)
        words = (
            f"none of 64 tries brings 'tip' to the target: the nearest is {distance:.4g} mm and"
        )
        assert found.reason.startswith(words)


def test_tolerances_are_used():
    """Half a metre too far is near enough for a tolerance of 0.6; a turned tool, too."""
    tree = load_kinematic_tree(PLANAR)
    found = inverse_kinematics(tree, at(3.5, 0.0, position_tolerance=0.6))
    assert 0.5 - 1e-9 <= found.position_error <= 0.6
    turned = pose_from_xyz_rpy((2.0, 1.0, 0.0), (0.0, 0.0, math.pi / 2 + 0.2))
    assert not inverse_kinematics(tree, PoseTarget("tip", turned), tries=64).is_success
    found = inverse_kinematics(tree, PoseTarget("tip", turned, rotation_tolerance=0.21))
    np.testing.assert_allclose(found.configurations, [[0.0, math.pi / 2]], atol=1e-6)
    assert found.rotation_error == pytest.approx(0.2, abs=1e-6)


def test_half_a_turn_is_found():
    """The worst start: the tool is turned by 180 degrees about each of its axes."""
    tree = load_kinematic_tree(resolve_resource(f"{ROBOTS}/ur_description/urdf/ur5_robot.urdf"))
    q = np.array([0.3, -1.0, 1.2, 0.4, 0.9, -0.2])
    for axis in range(3):
        rpy = np.zeros(3)
        rpy[axis] = math.pi
        X_WT = tree.link_poses(q, ["tool0"])[0] @ pose_from_xyz_rpy((0.0, 0.0, 0.0), rpy)
        found = inverse_kinematics(tree, PoseTarget("tool0", X_WT), near=q)
        assert found.is_success, found.reason


def test_a_drone_is_put_anywhere(tmp_path):
    """Its quaternion turns; it has no limits."""
    tree = SceneGraphCollisionChecker(diagram(tmp_path, DRONE)).plan.tree
    target = PoseTarget("body", pose_from_xyz_rpy((4.0, -5.0, 6.0), (2.0, -1.0, 3.0)))
    found = inverse_kinematics(tree, target, near=[0.0, -2.0, 0, 0, 0, 0, 0])
    distance, angle = errors(tree, found.configurations[0], target)
    assert distance <= 1e-9 and angle <= 1.01e-9
    assert np.linalg.norm(found.configurations[0, :4]) == pytest.approx(1.0, abs=1e-12)


@pytest.fixture(scope="module")
def cell():
    """A Panda between a table and a shelf, with what stands on them."""
    return SceneGraphCollisionChecker(load_robot_diagram("config/scenes/panda_cell.yaml"))


START = np.array([0.0, -0.4, 0.0, -2.0, 0.0, 1.6, 0.8, 0.02])


def test_solutions_are_free_and_the_same_for_the_same_seed(cell):
    """Ten of a hand in front of the Panda; the arm's group leaves the fingers where they are."""
    tree = cell.plan.tree
    X_WT = tree.link_poses(START, ["panda_hand"])[0]
    target = PoseTarget("panda_hand", X_WT)
    found = inverse_kinematics(cell, target, near=START, group="arm", solutions=10)
    assert len(found.configurations) == 10
    assert cell.check_configs_collision_free(found.configurations).all()
    assert (found.configurations[:, 7] == 0.02).all()
    far = np.linalg.norm(found.configurations - START, axis=1)
    assert (np.diff(far) >= 0.0).all() and far[0] < 1e-6
    again = inverse_kinematics(cell, target, near=START, group="arm", solutions=10)
    np.testing.assert_array_equal(again.configurations, found.configurations)
    other = inverse_kinematics(cell, target, near=START, group="arm", solutions=10, seed=1)
    assert not np.array_equal(other.configurations, found.configurations)


def test_what_collides_everywhere_says_with_what(tmp_path):
    """The ball on its rail is to be where another one is; they overlap by 0.3 m."""
    checker = SceneGraphCollisionChecker(diagram(tmp_path, SLIDE, BALL))
    target = PoseTarget("ball", pose_from_xyz_rpy((1.0, 0.0, 0.0)))
    found = inverse_kinematics(checker, target)
    assert found.failure is InverseKinematicsFailure.COLLIDES
    assert found.reason == (
        "the only configuration that reaches the target collides: robot/ball/ball_collision_0 and"
        " around/world/ball overlap by 300 mm"
    )
    np.testing.assert_allclose(found.nearest, [1.0], atol=1e-9)
    assert inverse_kinematics(checker.plan.tree, target).is_success
    plan = plan_path(checker, [0.0], target)
    assert plan.failure is PlanFailure.GOAL_COLLIDES
    assert plan.reason == f"the goal: {found.reason}"


def test_a_path_leads_to_a_pose(cell):
    """Of the hand, 0.2 m higher and aside; what cannot be reached says how near it came."""
    tree = cell.plan.tree
    X_WT = tree.link_poses(START, ["panda_hand"])[0].copy()
    X_WT[:3, 3] += [-0.05, 0.15, 0.2]
    target = PoseTarget("panda_hand", X_WT)
    plan = plan_path(cell, START, target, group="arm", timeout=60)
    assert plan.is_success and plan.proven, plan.reason
    distance, angle = errors(tree, plan.configurations[-1], target)
    assert distance <= 1e-9 and angle <= 1.01e-9
    np.testing.assert_array_equal(plan.configurations[0], START)
    X_WT[0, 3] += 5.0
    plan = plan_path(cell, START, PoseTarget("panda_hand", X_WT), group="arm")
    assert plan.failure is PlanFailure.GOAL_UNREACHED
    assert plan.reason.startswith("the goal: none of 256 tries brings 'panda_hand' to the target")


def test_bad_arguments_are_named():
    """With the field and the value."""
    tree = load_kinematic_tree(PLANAR)
    for field in ("position_tolerance", "rotation_tolerance"):
        with pytest.raises(InverseKinematicsError, match=f"{field} must be a positive number"):
            PoseTarget("tip", np.eye(4), **{field: 0.0})
    with pytest.raises(InvalidPoseError, match="X_WT of a target"):
        PoseTarget("tip", 2.0 * np.eye(4))
    for field, value in (("solutions", 0), ("tries", 1.5), ("seed", -1), ("tries", None)):
        with pytest.raises(InverseKinematicsError, match=f"{field} must be a whole number"):
            inverse_kinematics(tree, at(2.0, 1.0), **{field: value})
    with pytest.raises(
        InverseKinematicsError, match=r"near must have shape \(nq,\), not \(1, 2\)"
    ):
        inverse_kinematics(tree, at(2.0, 1.0), near=[[0.0, 0.0]])
    with pytest.raises(KinematicTreeError, match="no link 'top'"):
        inverse_kinematics(tree, PoseTarget("top", np.eye(4)))
    with pytest.raises(KinematicTreeError, match="has no group 'arm'"):
        inverse_kinematics(tree, at(2.0, 1.0), group="arm")
    with pytest.raises(KinematicTreeError, match="must be finite"):
        inverse_kinematics(tree, at(2.0, 1.0), near=[math.nan, 0.0])


@pytest.mark.parametrize("group", [None, "both"])
def test_joints_that_do_not_carry_the_link_stay(group):
    """A second arm, and what is behind the link; a joint that mimics carries by its leader."""

    def joint(name, parent, child, more=""):
        return (
            f'<link name="{child}"/><joint name="{name}" type="revolute"><axis xyz="0 0 1"/>'
            f'<origin xyz="0.5 0 0"/><parent link="{parent}"/><child link="{child}"/>'
            f'<limit lower="-2" upper="2" velocity="1"/>{more}</joint>'
        )

    urdf = (
        '<robot name="r"><link name="base"/>'
        + joint("l1", "base", "left_1")
        + joint("l2", "left_1", "left_2", '<mimic joint="lead"/>')
        + joint("l3", "left_2", "left_3")
        + joint("l4", "left_3", "left_4")
        + joint("lead", "base", "leader")
        + joint("r1", "base", "right_1")
        + "</robot>"
    )
    names = ("l1", "l2", "l3", "l4", "lead", "r1")
    joints = "".join(f'<joint name="{name}"/>' for name in names)
    tree = load_kinematic_tree(
        urdf, f'<robot name="r"><group name="both">{joints}</group></robot>'
    )
    near = np.linspace(0.1, 0.5, tree.num_positions)
    there = near.copy()
    for name in ("l1", "l3", "lead"):
        there[tree.position_index(name)] -= 0.7
    X_WT = tree.link_poses(there, ["left_3"])[0]
    found = inverse_kinematics(
        tree, PoseTarget("left_3", X_WT), near=near, group=group, solutions=4
    )
    assert found.is_success
    for name in ("l4", "r1"):
        column = tree.position_index(name)
        np.testing.assert_array_equal(found.configurations[:, column], near[column])
