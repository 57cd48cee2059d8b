"""Starts that are a little beyond limits, and positions beyond limits that do not move."""

from __future__ import annotations

import numpy as np
import pytest

from scene_graph_ros.planning import (
    plan_path,
    PlanFailure,
    PlanningError,
    RobotDiagramBuilder,
    SceneGraphCollisionChecker,
    time_path,
)
from scene_graph_ros.planning.trajectories import MotionLimits
from scene_graph_ros.trajectories.errors import TrajectoryError

URDF = """<robot name="two">
  <link name="base"/>
  <link name="arm"><collision><origin xyz="1 0 0"/><geometry><box size="1 0.1 0.1"/></geometry>
  </collision></link>
  <link name="grip"><collision><origin xyz="0 0 1"/><geometry><box size="0.1 0.1 0.1"/></geometry>
  </collision></link>
  <joint name="arm_j" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
  <joint name="grip_j" type="prismatic"><parent link="base"/><child link="grip"/>
    <axis xyz="0 0 1"/><limit lower="0" upper="1" effort="1" velocity="1"/></joint>
</robot>"""
SRDF = '<robot name="two"><group name="arm"><joint name="arm_j"/></group></robot>'
TOLERANCE = 1e-3


@pytest.fixture(scope="module")
def checker():
    """An arm with limits of 1 rad, and a gripper that opens upwards."""
    builder = RobotDiagramBuilder()
    builder.add_robot("two", URDF, SRDF)
    return SceneGraphCollisionChecker(builder.build())


@pytest.mark.parametrize("beyond", [-1e-12, -1e-9, -1e-6, -3e-4, -0.5])
def test_positions_that_do_not_move_need_not_be_within_limits(checker, beyond):
    """A gripper that reads beyond its limit, however far, does not keep the arm from moving."""
    start, goal = np.array([0.0, beyond]), np.array([0.5, beyond])
    plan = plan_path(checker, start, goal, group="arm", timeout=20.0)
    assert plan.is_success, plan.reason
    np.testing.assert_array_equal(plan.configurations[:, 1], beyond)


@pytest.mark.parametrize("beyond", [1e-6, 0.999 * TOLERANCE])
def test_a_start_a_little_beyond_its_limit_is_moved_back_by_the_first_edge(checker, beyond):
    """The path begins where the robot is; from its second configuration on it is within."""
    start, goal = np.array([1.0 + beyond, 0.0]), np.array([0.5, 0.0])
    plan = plan_path(checker, start, goal, start_tolerance=TOLERANCE)
    assert plan.is_success, plan.reason
    np.testing.assert_array_equal(plan.configurations[0], start)
    assert (plan.configurations[1:, 0] <= 1.0).all()
    assert plan.configurations[1, 0] == 1.0


@pytest.mark.parametrize(("beyond", "tolerance"), [(1e-6, 0.0), (1.001 * TOLERANCE, TOLERANCE)])
def test_a_start_farther_beyond_its_limit_is_refused(checker, beyond, tolerance):
    """The reason has limits and position."""
    start = np.array([1.0 + beyond, 0.0])
    plan = plan_path(checker, start, np.array([0.5, 0.0]), start_tolerance=tolerance)
    assert plan.failure is PlanFailure.START_BEYOND_LIMITS
    assert "beyond the limits [-1, 1] of 'arm_j'" in plan.reason


def test_goals_beyond_limits_are_refused_whatever_a_start_may(checker):
    """A tolerance is for what was measured."""
    goal = np.array([1.0 + 1e-4, 0.0])
    plan = plan_path(checker, np.array([0.0, 0.0]), goal, start_tolerance=TOLERANCE)
    assert plan.failure is PlanFailure.GOAL_BEYOND_LIMITS


def test_a_trajectory_leads_back_within_limits_and_stays_there(checker):
    """It begins beyond the limit by as much as the robot is, and by no more at any time."""
    start, goal = np.array([1.0 + 5e-4, 0.0]), np.array([0.5, 0.0])
    plan = plan_path(checker, start, goal, start_tolerance=TOLERANCE)
    limits = MotionLimits.of_tree(checker.plan.tree, accelerations=2.0)
    refused = time_path(checker, plan.configurations, limits)
    assert "position of 'arm_j'" in refused.reason
    timed = time_path(checker, plan.configurations, limits, start_tolerance=TOLERANCE)
    assert timed.is_success, timed.reason
    assert timed.points.positions[0, 0] == start[0]
    assert timed.trajectory.control_points[:, :, 0].max() <= start[0]
    assert timed.points.positions[-1, 0] == 0.5


def test_odd_tolerances_are_refused(checker):
    """Negative ones, and what is no number."""
    for tolerance in (-1e-3, np.nan, np.inf):
        with pytest.raises(PlanningError, match="start_tolerance must be"):
            plan_path(checker, np.zeros(2), np.zeros(2), start_tolerance=tolerance)


def test_jerks_in_the_place_of_names_are_named():
    """By position the third is the names."""
    with pytest.raises(TrajectoryError, match="jerks are given by that name"):
        MotionLimits(np.ones(2), np.ones(2), np.ones(2))
