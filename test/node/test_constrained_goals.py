"""A Panda in its cell is asked to hold constraints on the way, by a client of the node."""

from __future__ import annotations

from itertools import pairwise
import math
from pathlib import Path
from typing import Any

from action_msgs.msg import GoalStatus
from geometry_msgs.msg import Point, Pose, Quaternion, Vector3
import numpy as np
from plain_kinematics import PlainRobot
from plan_goals import Planner, Sent
import pytest

from msg_adapters.poses import pose_to_msg
from scene_graph_msgs.action import PlanPath
from scene_graph_msgs.msg import (
    LinkConstraint,
    MotionLimits,
    PoseGoal,
    RobotConfigurations,
    Status,
)
from scene_graph_ros.geometry.spatial.poses import pose_from_xyz_rpy
from scene_graph_ros.scene_files import resolve_resource

CELL = "config/scenes/panda_cell.yaml"
PANDA = "package://example-robot-data/robots/panda_description/urdf/panda.urdf"
ARM = [f"panda_joint{i}" for i in range(1, 8)]
START = [-0.7, -0.4, 0.0, -2.0, 0.0, 1.6, 0.8]  # the hand points down
INF = math.inf


@pytest.fixture(scope="module")
def action(client, start_node):
    """A client of a node with the cell."""
    start_node({"scene": CELL, "plan_from_unreported": True})
    planner = Planner(client)
    yield planner
    planner.destroy()


def upright(angle, **fields):
    """Return that the hand points down but for an angle."""
    return LinkConstraint(
        link="panda_hand",
        vector_in_frame=Vector3(z=-1.0),
        vector_in_link=Vector3(z=2.0),
        angle_upper=angle,
        **fields,
    )


def above(height):
    """Return that the hand is above a height in the world."""
    return LinkConstraint(
        type=LinkConstraint.POSITION,
        link="panda/panda_hand",
        point=Point(z=0.1),
        box=Pose(position=pose_to_msg(np.eye(4)).position),
        lower=Vector3(x=-INF, y=-INF, z=height),
        upper=Vector3(x=INF, y=INF, z=INF),
    )


def sent(action, *constraints, start=START, **fields):
    """Send the goal that the hand, pointing down, is over the table."""
    X_WT = pose_from_xyz_rpy((0.5, 0.3, 0.75), (np.pi, 0.0, 0.3))
    return Sent(
        action,
        start=RobotConfigurations(names=ARM, positions=start),
        pose_goals=[PoseGoal(link="panda_hand", pose=pose_to_msg(X_WT))],
        group="arm",
        constraints=list(constraints),
        **fields,
    )


@pytest.mark.parametrize("planner", ["", "fastest"])
def test_a_cup_is_carried_upright(action, planner):
    """The trajectory's polynomials, sampled by another kinematics, hold both constraints."""
    limits = MotionLimits(max_acceleration=5.0, max_jerk=100.0 if planner else 0.0)
    turned = LinkConstraint(
        type=LinkConstraint.ORIENTATION,
        link="panda_hand",
        frame="panda_link0",
        orientation=Quaternion(x=1.0, w=0.0),
        theta_bound=2.5,
    )
    goal = sent(
        action,
        upright(0.05),
        above(0.6),
        turned,
        planner=planner,
        with_trajectory=True,
        limits=limits,
    )
    result, status = goal.end()
    assert (result.status.code, result.failure) == (Status.OK, 0), (result.status, result.reason)
    assert status == GoalStatus.STATUS_SUCCEEDED
    robot = PlainRobot(Path(resolve_resource(PANDA)).read_text())
    path = np.array(result.path.positions).reshape(-1, 7)
    points = np.array([point.positions for point in result.trajectory.points])
    dense = np.concatenate(
        [a + np.linspace(0.0, 1.0, 50)[:, np.newaxis] * (b - a) for a, b in pairwise(path)]
    )
    for q in (*dense, *points):
        X = robot.relative(np.append(q, 0.02), None, "panda_hand")
        assert math.atan2(math.hypot(*X[:2, 2]), -X[2, 2]) <= 0.05 + 2e-9
        assert (X @ [0.0, 0.0, 0.1, 1.0])[2] + 0.4 >= 0.6 - 2e-9
        cosine = 0.5 * (np.trace(X[:3, :3] @ np.diag([1.0, -1.0, -1.0])) - 1.0)
        assert math.acos(np.clip(cosine, -1.0, 1.0)) <= 2.5 + 1e-7


@pytest.mark.parametrize("planner", ["", "fastest", "straight"])
def test_what_violates_a_constraint_is_told(action, planner):
    """The start, tilted by 0.4 rad; the goal, below the height that is asked for."""
    tilted = [*START[:5], START[5] + 0.4, START[6]]
    constraints = (above(0.5), upright(0.05))
    fields: dict[str, Any] = {"planner": planner}
    if planner == "fastest":
        limits = MotionLimits(max_acceleration=5.0, max_jerk=100.0)
        fields.update(with_trajectory=True, limits=limits)
    result, status = sent(action, *constraints, start=tilted, **fields).end()
    assert result.failure == PlanPath.Result.START_VIOLATES_CONSTRAINT
    assert status == GoalStatus.STATUS_ABORTED
    assert (
        "constraint 1 (AngleBetweenVectorsConstraint on 'panda/panda_hand'): the angle in the"
        " world must be from 0 to 0.05 rad, and is 0.4" in result.reason
    )
    result, _ = sent(action, above(0.7), **fields).end()
    assert result.failure == PlanPath.Result.GOAL_VIOLATES_CONSTRAINT, result.reason
    assert "z of its point in the box must be from 0.7 to inf m" in result.reason


def test_bad_constraints_are_refused(action):
    """With the field and its value, or what there may be at most."""
    nan = LinkConstraint(
        type=LinkConstraint.POSITION, link="panda_hand", lower=Vector3(x=math.nan)
    )
    reversed_box = above(0.5)
    reversed_box.upper.z = 0.4
    cases = [
        (upright(0.05, type=9), "constraints[1].type must be one of 0 (ANGLE_BETWEEN_VECTORS)"),
        (upright(0.0), "angle_upper must be above angle_lower by 0.0001 rad at least, not by 0"),
        (upright(math.nan), "angle_upper must be a finite number"),
        (upright(0.1, angle_lower=0.2), "not reversed"),
        (upright(0.1, frame="nowhere"), "constraints[1].frame"),
        (LinkConstraint(link="nowhere", angle_upper=0.1), "constraints[1].link"),
        (LinkConstraint(link="panda_hand", angle_upper=0.1), "constraints[1].vector_in_frame"),
        (nan, "constraints[1].lower must be three numbers"),
        (reversed_box, "constraints[1].upper must be above constraints[1].lower"),
    ]
    for bad, words in cases:
        result, status = sent(action, upright(0.1), bad).end()
        assert result.status.code != Status.OK and words in result.status.message, result.status
        assert status == GoalStatus.STATUS_ABORTED
    result, _ = sent(action, *[upright(0.1)] * 33).end()
    assert result.status.code == Status.TOO_LARGE
    assert "constraints must be 32 at most, and there are 33" in result.status.message
