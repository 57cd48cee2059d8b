"""A Panda in its cell is told where its hand is to be, by a client of the node."""

from __future__ import annotations

from action_msgs.msg import GoalStatus
import numpy as np
from plan_goals import Planner, Sent
import pytest

from msg_adapters.poses import pose_to_msg
from scene_graph_msgs.action import PlanPath
from scene_graph_msgs.msg import PoseGoal, RobotConfigurations, Status
from scene_graph_ros.geometry.spatial.poses import pose_from_xyz_rpy
from scene_graph_ros.planning import load_robot_diagram, SceneGraphCollisionChecker

CELL = "config/scenes/panda_cell.yaml"
ARM = [f"panda_joint{i}" for i in range(1, 8)]
START = [-0.7, -0.4, 0.0, -2.0, 0.0, 1.6, 0.8]
# Between the fingers, 0.1 m in front of the hand.
X_LT = pose_from_xyz_rpy((0.0, 0.0, 0.1))


@pytest.fixture(scope="module")
def action(client, start_node):
    """A client of a node with the cell."""
    start_node({"scene": CELL, "plan_from_unreported": True})
    planner = Planner(client)
    yield planner
    planner.destroy()


def grasp(x, y, z, roll=np.pi):
    """Return a goal for what is between the fingers; by default they point down."""
    X_WT = pose_from_xyz_rpy((x, y, z), (roll, 0.0, 0.3))
    return PoseGoal(link="panda_hand", tool=pose_to_msg(X_LT), pose=pose_to_msg(X_WT)), X_WT


def test_the_hand_goes_where_the_goal_says(action):
    """The path is proven, none of 100 configurations on each edge collides, and the tool is there.

    Only joints of the group move.
    """
    goal, X_WT = grasp(0.5, 0.3, 0.75)
    start = RobotConfigurations(names=ARM, positions=START)
    sent = Sent(action, start=start, pose_goals=[goal], group="arm", environment_padding=0.01)
    result, status = sent.end()
    assert (result.status.code, result.failure) == (Status.OK, 0), (result.status, result.reason)
    assert status == GoalStatus.STATUS_SUCCEEDED and result.goal == 0
    assert result.path.names == [f"panda/{name}" for name in ARM]
    path = np.array(result.path.positions).reshape(-1, 7)
    np.testing.assert_array_equal(path[0], START)
    robots = load_robot_diagram(CELL)
    q = np.tile(robots.tree.zero_configuration(), (len(path), 1))
    q[:, [robots.tree.position_index(name) for name in ARM]] = path
    X_WE = robots.tree.link_poses(q[-1], ["panda_hand"])[0] @ X_LT
    np.testing.assert_allclose(X_WE, X_WT, atol=3e-9)
    checker = SceneGraphCollisionChecker(robots, env_collision_padding=0.01)
    t = np.linspace(0.0, 1.0, 100)[:, np.newaxis, np.newaxis]
    along = ((1.0 - t) * q[:-1] + t * q[1:]).reshape(-1, q.shape[1])
    assert checker.check_configs_collision_free(along).all()


def test_what_no_hand_reaches_or_where_it_collides_is_told(action):
    """Five metres away; and pointing up from within the table."""
    far, _ = grasp(5.0, 0.0, 0.7)
    result, status = Sent(action, pose_goals=[far], group="arm").end()
    assert (result.status.code, result.failure) == (Status.OK, PlanPath.Result.GOAL_UNREACHED)
    assert status == GoalStatus.STATUS_ABORTED
    assert "tries brings 'panda/panda_hand' to the target: the nearest is" in result.reason
    inside, _ = grasp(0.5, 0.0, 0.45)
    result, _ = Sent(action, pose_goals=[inside], group="arm").end()
    assert result.failure == PlanPath.Result.GOAL_COLLIDES, result.reason
    assert "overlap by" in result.reason


def test_looking_for_configurations_is_cancelled(action):
    """While it is told that goals are checked: a thousand that cannot be reached."""
    far, _ = grasp(5.0, 0.0, 0.7)
    sent = Sent(action, pose_goals=[far] * 1000, group="arm")
    sent.wait_for(PlanPath.Feedback.CHECKING)
    assert len(sent.cancel().goals_canceling) == 1
    result, status = sent.end()
    assert status == GoalStatus.STATUS_CANCELED
    assert result.failure == PlanPath.Result.CANCELED
