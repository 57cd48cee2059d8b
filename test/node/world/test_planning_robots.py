"""Robots as planning asks about them, while their bases move."""

from __future__ import annotations

import numpy as np
import pytest
from robot_inputs import NOW, ODOMETRY, odometry, Robot, TWO

from scene_graph_ros.node.world.inputs import BASE_POSES
from scene_graph_ros.node.world.planning_robots import PlanningRobots
from scene_graph_ros.planning.errors import CollisionCheckerError

POST = """
sources: [{name: s}]
geometries:
  - {name: post, source: s, pose: {xyz: [3, 0, 0]}, shape: {type: box, size: [0.2, 0.2, 4]}}
  - {name: floor, source: s, pose: {xyz: [0, 0, -2]}, shape: {type: half_space}}
"""


def planning_of(robot):
    """Return what planning asks, and the snapshot that it is about."""
    snapshot = robot.world.snapshot
    return snapshot.robots.planning(snapshot.query.snapshot, snapshot.bases), snapshot


def anew(robot, snapshot):
    """Return the same, made of nothing that was there."""
    scene = snapshot.robots
    about = scene.robots, scene.scene_graph, scene.context
    return PlanningRobots(*about, snapshot.query.snapshot, {}, snapshot.bases)


def test_a_base_that_moves_is_as_planned_anew(tmp_path):
    """Distances of all pairs at many configurations, to the last bit; nothing else is made."""
    robot = Robot(tmp_path, TWO, keys=ODOMETRY + POST)
    before, _ = planning_of(robot)
    q = np.random.default_rng(0).uniform(-2.0, 2.0, (20, 2))
    clearances = []
    for k in range(1, 4):
        robot.send(BASE_POSES, odometry(NOW + k, 0.5 * k, yaw=0.3 * k))
        found, snapshot = planning_of(robot)
        assert found is not before
        assert found.positions is before.positions
        own, other = (
            each.checker(
                snapshot.query.snapshot, environment_padding=0.01, self_padding=0.0
            ).calc_clearance_columns(q, 10.0)
            for each in (found, anew(robot, snapshot))
        )
        for name in own._fields:
            np.testing.assert_array_equal(getattr(own, name), getattr(other, name), name)
        clearances.append(own.distance)
        again, _ = planning_of(robot)
        assert again is found
    assert not np.array_equal(clearances[0], clearances[1])


def test_a_checker_takes_no_other_robots(tmp_path):
    """They must have the same positions and links."""
    (tmp_path / "a").mkdir()
    robots, _ = planning_of(Robot(tmp_path, TWO))
    others, snapshot = planning_of(Robot(tmp_path / "a", TWO.replace("arm_j", "arm_k")))
    with pytest.raises(CollisionCheckerError):
        robots._checker.at(snapshot.query.snapshot, model=others._checker.model)
