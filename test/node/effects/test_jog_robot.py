"""The filter of a node's jogging: a ball on a rail before a post of a source that sends poses."""

from __future__ import annotations

import numpy as np
import pytest
from robot_scenes import SLIDE
import sliding_robots
from sliding_robots import rail_world, slide

from scene_graph_ros.node.effects.jog_robot import JogRobot, JogSettings

RATE, KEEP, GAIN = 100.0, 0.05, 5.0


@pytest.fixture
def world(tmp_path, monkeypatch):
    """The ball is 0.2 m from the post, at 0.5; it may go 2 m/s."""
    fast = SLIDE.replace('upper="9"', 'upper="9" velocity="2"')
    monkeypatch.setattr(sliding_robots, "SLIDE", fast)
    world = rail_world(tmp_path)
    slide(world, "slide", 0.5)
    return world


@pytest.mark.parametrize("speed", [0.0, 0.05, 0.2, 1.0])
def test_what_an_obstacle_may_do_is_left_to_it(world, speed):
    """The distance above that to keep, 0.15 m, may shrink by 5 times itself each second.

    That is 0.75 m/s; as fast as the post may come, so much slower the ball goes, or away from it.
    """
    robot = JogRobot(JogSettings("slide", "", RATE, KEEP, GAIN, 1e3, 0.0, speed, 1.0, 1e9, 0.0))
    assert robot.see(world.snapshot) == ""
    for _ in range(10):
        step = robot.step(lambda _, q: np.ones(len(q)), 1)
    assert step.reason == "" and step.safe.is_kept
    most = GAIN * (0.2 - KEEP) - speed
    # Within a period the distance goes on shrinking: 2.5 % of the speed, half of 5 / s for 10 ms.
    assert step.velocity[0] == pytest.approx(most, rel=0.026)
    assert step.velocity[0] <= most + 1e-9
    assert len(step.safe.active) == 1
