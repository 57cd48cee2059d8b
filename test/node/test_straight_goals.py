"""A Panda's tool is led along straight lines, by a client of the node."""

from __future__ import annotations

from action_msgs.msg import GoalStatus
from builtin_interfaces.msg import Duration
import numpy as np
from plan_goals import Planner, Sent
import pytest
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from msg_adapters.poses import pose_to_msg
from msg_adapters.trajectories import joint_trajectory_from_msg
from scene_graph_msgs.action import PlanPath
from scene_graph_msgs.msg import MotionLimits, PoseGoal, RobotConfigurations, Status
from scene_graph_ros.geometry.spatial.poses import pose_from_xyz_rpy
from scene_graph_ros.planning import load_robot_diagram, SceneGraphCollisionChecker

CELL = "config/scenes/panda_cell.yaml"
ARM = [f"panda_joint{i}" for i in range(1, 8)]
START = [0.0, -0.4, 0.0, -2.0, 0.0, 1.6, 0.8]
X_LT = pose_from_xyz_rpy((0.0, 0.0, 0.1))


@pytest.fixture(scope="module")
def action(client, start_node):
    """A client of a node with the cell."""
    start_node({"scene": CELL, "plan_from_unreported": True})
    planner = Planner(client)
    yield planner
    planner.destroy()


@pytest.fixture(scope="module")
def robots():
    """The same cell, apart from the node."""
    return load_robot_diagram(CELL)


def at(robots, rows):
    """Return configurations of all positions."""
    rows = np.atleast_2d(rows)
    q = np.tile(robots.tree.zero_configuration(), (len(rows), 1))
    q[:, [robots.tree.position_index(name) for name in ARM]] = rows
    return q


def tool(robots, rows):
    """Return where the tool is."""
    return robots.tree.link_poses(at(robots, rows), ["panda_hand"])[:, 0] @ X_LT


def goal(X_WT, **fields):
    """Return a goal for the tool."""
    return PoseGoal(link="panda_hand", tool=pose_to_msg(X_LT), pose=pose_to_msg(X_WT), **fields)


def by(X_WT, x=0.0, y=0.0, z=0.0):
    """Return a pose that is moved in the world."""
    moved = X_WT.copy()
    moved[:3, 3] += (x, y, z)
    return moved


LINE = {
    "planner": "straight",
    "group": "arm",
    "start": RobotConfigurations(names=ARM, positions=START),
}


def test_the_tool_goes_along_lines_through_all_poses(action, robots):
    """Up and aside: within 0.1 mm of the lines at 100 configurations on each edge, and free."""
    first = tool(robots, START)[0]
    corners = [first, by(first, z=0.1), by(first, z=0.1, y=0.2)]
    limits = MotionLimits(max_acceleration=5.0)
    sent = Sent(
        action,
        pose_goals=[goal(X) for X in corners[1:]],
        with_trajectory=True,
        limits=limits,
        **LINE,
    )
    result, status = sent.end()
    assert (result.status.code, result.failure) == (Status.OK, 0), (result.status, result.reason)
    assert status == GoalStatus.STATUS_SUCCEEDED and result.least_clearance > 0.0
    path = np.array(result.path.positions).reshape(-1, 7)
    np.testing.assert_array_equal(path[0], START)
    t = np.linspace(0.0, 1.0, 100)[:, np.newaxis, np.newaxis]
    along = ((1.0 - t) * path[:-1] + t * path[1:]).reshape(-1, 7)
    p = tool(robots, along)[:, :3, 3] - first[:3, 3]
    off_up = np.hypot(p[:, 0], p[:, 1])
    off_aside = np.hypot(p[:, 0], p[:, 2] - 0.1)
    assert np.minimum(off_up, off_aside).max() < 1e-4
    assert SceneGraphCollisionChecker(robots).check_configs_collision_free(at(robots, along)).all()
    _, points = joint_trajectory_from_msg(result.trajectory)
    end = tool(robots, points.positions[-1])[0]
    np.testing.assert_allclose(end, corners[-1], atol=3e-9)


def test_it_ends_where_it_must_and_says_why(action, robots):
    """Down into the table; and to where the arm ends: the path up to there is on its line."""
    first = tool(robots, START)[0]
    for X, failure in (
        (by(first, z=-0.6), PlanPath.Result.NOT_FREE),
        (by(first, x=3.0), PlanPath.Result.GOAL_UNREACHED),
    ):
        result, status = Sent(action, pose_goals=[goal(X)], **LINE).end()
        assert (result.status.code, result.failure) == (Status.OK, failure), result.reason
        assert status == GoalStatus.STATUS_ABORTED
        path = np.array(result.path.positions).reshape(-1, 7)
        way = X[:3, 3] - first[:3, 3]
        moved = tool(robots, path[-1])[0][:3, 3] - first[:3, 3]
        share = moved @ way / (way @ way)
        assert 0.05 < share < 0.95 and np.linalg.norm(moved - share * way) < 1e-8
        assert f"the tool comes {100.0 * share:.4g} % far" in result.reason


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"goals": RobotConfigurations(names=ARM, positions=START)}, "goals must be empty"),
        ({"pose_goals": "tolerance"}, "pose_goals[0] has a tolerance"),
        ({"pose_goals": "links"}, "pose_goals[1] is of another link or tool"),
        ({"pose_goals": "none"}, "goals.names is empty, and so is pose_goals"),
        ({"start_overlap": 0.01}, "start_overlap must be 0, with the planner 'straight'"),
        ({"rise_time": Duration(sec=1)}, "rise_time must be 0, with the planner 'straight'"),
        ({"executing": "moving"}, "with_trajectory must be true where executing is replaced"),
    ],
)
def test_goals_without_a_meaning_are_refused(action, robots, fields, words):
    """Naming the field."""
    first = tool(robots, START)[0]
    lists = {
        "tolerance": [goal(by(first, z=0.1), position_tolerance=0.01)],
        "links": [goal(by(first, z=0.1)), PoseGoal(link="panda_link7", pose=pose_to_msg(first))],
        "none": [],
        "moving": JointTrajectory(
            joint_names=ARM,
            points=[JointTrajectoryPoint(positions=START, velocities=[0.0] * 7)],
        ),
    }
    given = {name: lists.get(v, v) if isinstance(v, str) else v for name, v in fields.items()}
    asked = {**LINE, "pose_goals": [goal(by(first, z=0.1))], **given}
    if "goals" in given:
        del asked["pose_goals"]
    result, _ = Sent(action, **asked).end()
    assert result.status.code == Status.INVALID_ARGUMENT
    assert words in result.status.message, result.status.message
