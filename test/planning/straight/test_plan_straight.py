"""Motions of a tool along lines and arcs: on their way, without jumps, and why they end."""

from itertools import pairwise
import math

import numpy as np
import pytest
from robot_scenes import BALL, diagram, SLIDE
from scipy.spatial.transform import Rotation

from scene_graph_ros.geometry.errors import InvalidPoseError
from scene_graph_ros.geometry.spatial.poses import pose_from_xyz_rpy
from scene_graph_ros.planning import (
    InverseKinematicsError,
    load_robot_diagram,
    plan_straight,
    SceneGraphCollisionChecker,
    StraightFailure,
)
from scene_graph_ros.trajectories import MotionLimits

START = np.array([0.0, -0.4, 0.0, -2.0, 0.0, 1.6, 0.8, 0.02])
HAND = "panda_hand"


@pytest.fixture(scope="module")
def cell():
    """A Panda between a table and a shelf, with what stands on them."""
    return SceneGraphCollisionChecker(load_robot_diagram("config/scenes/panda_cell.yaml"))


def hand(cell, q):
    """Return the poses of the hand."""
    return cell.plan.tree.link_poses(q, [HAND])[..., 0, :, :]


def along(plan, samples=15):
    """Return configurations on all edges of a plan."""
    t = np.linspace(0.0, 1.0, samples)[:, np.newaxis]
    q = plan.configurations
    return np.concatenate([a + t * (b - a) for a, b in pairwise(q)])


def angles(R, R_0):
    """Return the angles (rad) between rotations and one."""
    return 2.0 * np.arcsin(np.linalg.norm(R - R_0, axis=(1, 2)) / math.sqrt(8.0))


def assert_sound(cell, plan):
    """It leads to the end without jumps, is free, and as exact as was asked for."""
    assert plan.is_success and plan.fraction == 1.0, plan.reason
    assert (np.diff(plan.fractions) > 0.0).all()
    q = plan.configurations
    assert np.abs(np.diff(q, axis=0)).max() <= 0.1 + 1e-12
    assert cell.check_edges_collision_free(np.stack([q[:-1], q[1:]], axis=1)).all()
    assert plan.least_clearance > 0.0
    assert plan.deviation <= 1e-4 and plan.rotation_deviation <= 1e-3
    assert (q[:, 7] == START[7]).all()


def test_the_hand_goes_along_a_line_and_does_not_turn(cell):
    """Never farther off than is told, between configurations, too; on it at these."""
    X_0 = hand(cell, START)
    X_1 = X_0.copy()
    way = np.array([-0.05, 0.15, 0.1])
    X_1[:3, 3] += way
    plan = plan_straight(cell, START, [X_1], HAND)
    assert_sound(cell, plan)
    for q, most, turn in (
        (along(plan), plan.deviation, plan.rotation_deviation),
        (plan.configurations, 2e-9, 2e-9),
    ):
        X = hand(cell, q)
        gone = X[:, :3, 3] - X_0[:3, 3]
        off = gone - np.outer(gone @ way / (way @ way), way)
        assert np.linalg.norm(off, axis=1).max() <= most
        assert angles(X[:, :3, :3], X_0[:3, :3]).max() <= turn
    np.testing.assert_allclose(hand(cell, plan.configurations[-1]), X_1, atol=1e-8)


def test_a_tool_turns_about_its_tip(cell):
    """The origin of a tool 10 cm before the hand stays, while it turns by 0.5 rad."""
    X_LT = pose_from_xyz_rpy((0.0, 0.0, 0.1))
    X_0 = hand(cell, START) @ X_LT
    X_1 = X_0 @ pose_from_xyz_rpy((0.0, 0.0, 0.0), (0.3, 0.4, 0.0))
    plan = plan_straight(cell, START, [X_1], HAND, X_LT)
    assert_sound(cell, plan)
    X = hand(cell, along(plan)) @ X_LT
    assert np.linalg.norm(X[:, :3, 3] - X_0[:3, 3], axis=1).max() <= plan.deviation
    # It turns about one axis: what is left to the end and what is done add up.
    whole = angles(X_1[np.newaxis, :3, :3], X_0[:3, :3])[0]
    done, left = (angles(X[:, :3, :3], Y[:3, :3]) for Y in (X_0, X_1))
    assert (done + left - whole).max() <= 2.0 * plan.rotation_deviation


def test_a_screw_leads_along_an_arc(cell):
    """About an upright axis 20 cm beside the hand: the distance from it stays."""
    X_0 = hand(cell, START)
    axis = X_0[:3, 3] + [0.0, 0.2, 0.0]
    about = pose_from_xyz_rpy(axis) @ pose_from_xyz_rpy((0, 0, 0), (0, 0, 0.6))
    X_1 = about @ pose_from_xyz_rpy(-axis) @ X_0
    plan = plan_straight(cell, START, [X_1], HAND, motion="screw")
    assert_sound(cell, plan)
    X = hand(cell, along(plan))
    radii = np.linalg.norm(X[:, :2, 3] - axis[:2], axis=1)
    np.testing.assert_allclose(radii, 0.2, atol=plan.deviation)
    np.testing.assert_allclose(X[:, 2, 3], X_0[2, 3], atol=plan.deviation)
    lifted = X_1.copy()
    lifted[2, 3] += 0.1  # a helix: height and turn keep pace
    plan = plan_straight(cell, START, [lifted], HAND, motion="screw")
    assert_sound(cell, plan)
    X = hand(cell, plan.configurations)
    turned = angles(X[:, :3, :3], X_0[:3, :3]) / 0.6
    np.testing.assert_allclose(X[:, 2, 3] - X_0[2, 3], 0.1 * turned, atol=1e-7)


def test_a_way_through_poses_is_timed(cell):
    """There and back again, with limits: a trajectory to the start."""
    X_0 = hand(cell, START)
    limits = MotionLimits(np.ones(7), np.full(7, 4.0), cell.plan.tree.position_names[:7])
    X_1 = X_0.copy()
    X_1[:3, 3] += [0.0, 0.0, 0.1]
    plan = plan_straight(cell, START, [X_1, X_1, X_0], HAND, limits=limits, deviation=1e-3)
    assert plan.is_success and plan.timed.points is not None
    np.testing.assert_allclose(hand(cell, plan.configurations[-1]), X_0, atol=1e-8)


def test_a_way_ends_at_a_limit_or_what_is_in_it(tmp_path):
    """On a rail the fraction is known: to its end, and to where two balls touch."""
    free = SceneGraphCollisionChecker(diagram(tmp_path, SLIDE))
    tree = free.plan.tree
    end, far = tree.upper[0], tree.upper[0] + 1.0
    plan = plan_straight(free, [0.0], [pose_from_xyz_rpy((far, 0.0, 0.0))], "ball")
    assert plan.failure is StraightFailure.JOINT_LIMIT
    assert plan.fraction == pytest.approx(end / far, abs=1e-5)
    assert plan.configurations[-1, 0] <= end
    assert plan.reason.startswith("the way goes on, but joint ") and f"{end:.6g}" in plan.reason


def test_what_is_in_the_way_is_named(tmp_path):
    """The proven part ends before the two balls touch."""
    checker = SceneGraphCollisionChecker(diagram(tmp_path, SLIDE, BALL))
    plan = plan_straight(checker, [0.0], [pose_from_xyz_rpy((1.0, 0.0, 0.0))], "ball")
    assert plan.failure is StraightFailure.COLLIDES and plan.timed is None
    assert "around/world/ball" in plan.reason
    assert 0.0 < plan.fraction < 1.0
    q = plan.configurations
    assert checker.check_edges_collision_free(np.stack([q[:-1], q[1:]], axis=1)).all()
    start = plan_straight(checker, [1.0], [pose_from_xyz_rpy((0.0, 0.0, 0.0))], "ball")
    assert start.failure is StraightFailure.START and start.fraction == 0.0


def test_what_is_out_of_reach_says_how_far_it_goes(cell):
    """Up by two metres: the arm is stretched before."""
    X_1 = hand(cell, START).copy()
    X_1[2, 3] += 2.0
    plan = plan_straight(cell, START, [X_1], HAND)
    kinds = StraightFailure.JOINT_LIMIT, StraightFailure.OUT_OF_REACH, StraightFailure.TOO_FAST
    assert plan.failure in kinds and plan.reason
    assert 0.05 < plan.fraction < 0.6
    assert np.abs(np.diff(plan.configurations, axis=0)).max() <= 0.1 + 1e-12
    over = plan_straight(cell, START, [X_1], HAND, timeout=1e-9)
    assert over.failure is StraightFailure.TIMEOUT and over.fraction == 0.0


FLYING = """<robot name="flying"><link name="world"/><link name="base"><collision><geometry>
  <box size="0.2 0.2 0.2"/></geometry></collision></link><link name="arm"/>
  <joint name="f" type="floating"><parent link="world"/><child link="base"/></joint>
  <joint name="a" type="revolute"><parent link="base"/><child link="arm"/>
    <origin xyz="0.3 0 0.1"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>"""


@pytest.mark.parametrize("pitch", [0.0, 1.0, 1.5, 0.5 * np.pi, -0.5 * np.pi, 3.0])
def test_a_floating_base_turns_as_edges_do_not_as_its_angles(tmp_path, pitch):
    """Its edges turn about one axis, also where three angles could not say how."""
    flying = SceneGraphCollisionChecker(diagram(tmp_path, FLYING))
    tree = flying.plan.tree
    start = tree.zero_configuration()
    start[:4] = Rotation.from_euler("XYZ", [0.1, pitch, 0.2]).as_quat()[[3, 0, 1, 2]]
    X_LT = pose_from_xyz_rpy([0.4, 0.0, 0.2])
    X_0 = tree.link_poses(start, ["arm"])[0] @ X_LT
    way, turn = np.array([0.1, 0.05, 0.0]), np.array([0.3, 0.2, 0.4])
    X_1 = X_0.copy()
    X_1[:3, :3] = Rotation.from_rotvec(turn).as_matrix() @ X_0[:3, :3]
    X_1[:3, 3] += way
    plan = plan_straight(flying, start, [X_1], "arm", X_LT)
    assert plan.is_success and len(plan.configurations) <= 25
    s = np.linspace(0.0, 1.0, 21)
    for k, (first, second) in enumerate(pairwise(plan.configurations)):
        q = [flying.interpolate_between_configurations(first, second, t) for t in s]
        X = tree.link_poses(np.array(q), ["arm"])[:, 0] @ X_LT
        gone = X[:, :3, 3] - X_0[:3, 3]
        off = gone - np.outer(gone @ way / (way @ way), way)
        assert np.linalg.norm(off, axis=1).max() <= plan.deviation
        f = plan.fractions[k] + s * (plan.fractions[k + 1] - plan.fractions[k])
        right = Rotation.from_rotvec(f[:, np.newaxis] * turn).as_matrix() @ X_0[:3, :3]
        assert angles(X[:, :3, :3], right).max() <= plan.rotation_deviation


@pytest.mark.parametrize("axis", np.eye(3))
def test_a_floating_base_goes_on_turning(tmp_path, axis):
    """By 3 rad about each axis, from turns all around: no step is shorter than at first."""
    flying = SceneGraphCollisionChecker(diagram(tmp_path, FLYING))
    tree = flying.plan.tree
    for R in Rotation.create_group("O"):
        start = tree.zero_configuration()
        start[:4] = R.as_quat()[[3, 0, 1, 2]]
        X_1 = np.eye(4)
        X_1[:3, :3] = Rotation.from_rotvec(3.0 * axis).as_matrix() @ R.as_matrix()
        plan = plan_straight(flying, start, [X_1], "base")
        assert plan.is_success, plan.reason
        Q = plan.configurations[:, :4]
        assert 2.0 * np.arccos((Q[:-1] * Q[1:]).sum(axis=1)).min() > 0.01
        assert len(Q) <= 90
        np.testing.assert_allclose(tree.link_poses(plan.configurations[-1], ["base"])[0], X_1,
                                   atol=1e-8)  # fmt: skip


def test_no_way_and_bad_arguments(cell):
    """With the name of the argument."""
    X_0 = hand(cell, START)
    still = plan_straight(cell, START, [X_0], HAND)
    assert still.is_success and still.fraction == 1.0 and still.deviation <= 1e-8
    for field, value in (("deviation", 0.0), ("rotation_deviation", "x")):
        with pytest.raises(InverseKinematicsError, match=f"{field} must be a positive number"):
            plan_straight(cell, START, [X_0], HAND, **{field: value})
    with pytest.raises(InverseKinematicsError, match="motion must be one of straight, screw"):
        plan_straight(cell, START, [X_0], HAND, motion="round")
    with pytest.raises(InvalidPoseError, match="X_WTs"):
        plan_straight(cell, START, [2.0 * X_0], HAND)
    with pytest.raises(InverseKinematicsError, match="start must be a configuration"):
        plan_straight(cell, None, [X_0], HAND)
