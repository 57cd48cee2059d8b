"""A Panda in its cell moves through regions that the node grows: looked at again by samples."""

from __future__ import annotations

from action_msgs.msg import GoalStatus
import numpy as np
from plan_goals import Planner, Sent
import pytest

from msg_adapters.trajectories import joint_trajectory_from_msg
from scene_graph_msgs.msg import (
    MotionLimits,
    RegionTrajectoryOptions,
    RobotConfigurations,
    Status,
)
from scene_graph_ros.planning import load_robot_diagram, SceneGraphCollisionChecker

CELL = "config/scenes/panda_cell.yaml"
ARM = [f"panda_joint{i}" for i in range(1, 8)]
SPEEDS = np.array([2.175] * 4 + [2.61] * 3)
"""rad/s, of the URDF."""
START = [-0.5, 0.3, 0.0, -2.0, 0.0, 2.3, 0.785]
GOAL = [1.095, 0.135, 0.27, -2.219, -0.321, 3.6, 0.785]


def ended(action, **fields):
    """Return the result of a goal that must succeed."""
    result, status = Sent(action, **fields).end()
    assert (result.status.code, result.failure) == (Status.OK, 0), (result.status, result.reason)
    assert status == GoalStatus.STATUS_SUCCEEDED
    return result


def test_a_panda_moves_through_its_regions(client, start_node):
    """From beside the table into the shelf: free and within limits at 2000 moments.

    No way is faster than the slowest joint needs for its part at full speed.
    """
    start_node({"scene": CELL})
    planner = Planner(client)
    goal = {
        "start": RobotConfigurations(names=ARM, positions=START),
        "goals": RobotConfigurations(names=ARM, positions=GOAL),
        "group": "arm",
        "planner": "regions",
        "regions": RegionTrajectoryOptions(growth_padding=0.015, num_particles=500, search=True),
        "with_trajectory": True,
        "limits": MotionLimits(max_acceleration=5.0),
        "seed": 5,
    }
    result = ended(planner, **goal)
    way = result.through_regions
    needed = float((np.abs(np.subtract(GOAL, START)) / SPEEDS).max())
    assert way.cost >= needed - 1e-9
    assert way.lower_bound <= way.cost + 1e-9
    assert way.gap < 1e-5 * way.cost
    names, points = joint_trajectory_from_msg(result.trajectory)
    assert names == tuple(ARM)
    motion = points.trajectory()
    times = np.linspace(0.0, motion.end_time, 2000)
    q = motion.value(times)
    np.testing.assert_allclose(q[[0, -1]], [START, GOAL], atol=1e-9)
    robots = load_robot_diagram(CELL)
    whole = np.tile(robots.tree.zero_configuration(), (len(q), 1))
    whole[:, [robots.tree.position_index(name) for name in ARM]] = q
    checker = SceneGraphCollisionChecker(robots)
    assert checker.check_configs_collision_free(whole).all()
    step = times[1] - times[0]
    velocities = np.diff(q, axis=0) / step
    assert (np.abs(velocities) <= SPEEDS * (1.0 + 1e-9)).all()
    assert np.abs(velocities[[0, -1]]).max() < 5.0 * step
    # A second difference is a mean of accelerations, which are at most 5 rad/s^2.
    assert np.abs(np.diff(velocities, axis=0) / step).max() <= 5.0 * (1.0 + 1e-6)
    nearest = min(
        checker.calc_robot_clearance(each, 0.1).distances.min(initial=0.1) for each in whole[::10]
    )
    assert 0.0 < result.trajectory_clearance <= nearest + 1e-9
    # The regions are there for the way back, which takes as long.
    goal |= {"start": goal["goals"], "goals": goal["start"]}
    goal["regions"] = RegionTrajectoryOptions(text=way.grown, search=True)
    back = ended(planner, **goal)
    assert back.through_regions.cost == pytest.approx(way.cost, rel=1e-5)
    assert len(back.through_regions.regions) == len(way.regions)
    planner.destroy()
