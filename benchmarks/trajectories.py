"""How long it takes to time paths, and how far from the fastest they are.

``python -m benchmarks.trajectories`` prints processor times of one thread, and durations beside
exact ones: those of straight ways, which are known, and of corners that are cut into many more
stretches. TOPP-RA's own implementation takes part where ``toppra`` is installed, which is not
needed otherwise::

    pip install toppra==0.6.10
"""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec
import logging
import time
from typing import Any

import numpy as np

from scene_graph_ros.planning import (
    load_robot_diagram,
    plan_path,
    SceneGraphCollisionChecker,
    time_path,
)
from scene_graph_ros.planning.trajectories import MotionLimits, PiecewisePolynomial, retime
from scene_graph_ros.planning.trajectories.corners import CornerPath
from scene_graph_ros.planning.trajectories.sampling import sample

__all__ = ["main"]

_SCENE = "config/scenes/panda_cell.yaml"
_START = (1.07, 1.31, 0.81, -1.17, 2.78, 2.67, -1.38, 0.02)
_GOAL = (1.37, 0.75, 0.17, -0.51, 2.53, 3.09, -0.12, 0.02)
"""Positions (rad, m) with the hand below and above a board of the shelf."""
_PADDING = 0.005
_ACCELERATION = 5.0
_REPEATS = 7
_GRIDS = (2, 4, 8, 16, 32, 64)
_BEST = 1024
_RISE_TIME = 0.05


def _milliseconds(function: Callable[[], Any]) -> tuple[float, Any]:
    """Return the least processor time of a call, and what it returned."""
    result, times = function(), []
    for _ in range(_REPEATS):
        begin = time.process_time()
        result = function()
        times.append(time.process_time() - begin)
    return 1e3 * min(times), result


def _straight_ways() -> None:
    """Print how much longer than they must straight ways take."""
    v, a = 2.0, 5.0
    limits = MotionLimits([v, v], [a, a])
    print(f"{'a straight way, rad':32} {'least, s':>12} {'ours, longer by':>16}", end="")
    print(f" {'toppra, longer by':>18}" if find_spec("toppra") else "")
    for way in (10.0, 1.0, 1e-3, 1e-6, 1e-9):
        least = 2.0 * np.sqrt(way / a) if way < v * v / a else way / v + v / a
        ends = np.array([[0.0, 0.0], [way, 0.5 * way]])
        motion = retime(PiecewisePolynomial.first_order_hold([0.0, 1.0], ends), limits)
        ours = sample(motion, limits).points.duration / least - 1.0
        print(f"{way:<32g} {least:12.6g} {ours:16.1e}", end="")
        if find_spec("toppra"):
            found = _toppra(np.array([0.0, 0.5, 1.0]), np.linspace(*ends, 3), limits)
            print(f" {'none' if found is None else f'{found.duration / least - 1.0:.1e}':>18}")
        else:
            print()


def _corners(path: np.ndarray, limits: MotionLimits) -> None:
    """Print how much longer a rounded path takes where its corners are cut into few stretches."""
    corners = CornerPath(path, limits.velocities)
    rounded = corners.rounded(corners.largest_sizes())
    best = retime(rounded, limits, grid_points=_BEST).duration
    print(f"\n{'stretches of each corner':32} {'retime, ms':>12} {'longer by':>16}", end="")
    print(f" {'then slowed by':>18}")
    for grid in _GRIDS:
        milliseconds, motion = _milliseconds(lambda g=grid: retime(rounded, limits, grid_points=g))
        slower = sample(motion, limits).factor - 1.0
        longer = motion.duration / best - 1.0
        print(f"{grid:<32} {milliseconds:12.2f} {longer:16.1e} {slower:18.1e}")
    if find_spec("toppra"):
        knots = np.linspace(0.0, 1.0, len(path))
        for grid in (50, 100, 200, 1000):
            milliseconds, found = _milliseconds(lambda g=grid: _toppra(knots, path, limits, g))
            t = np.linspace(0.0, found.duration, 100_001)
            beyond = [
                np.abs(found(t, order) / most).max() - 1.0
                for order, most in ((1, limits.velocities), (2, limits.accelerations))
            ]
            print(
                f"toppra, a spline, grid {grid:<9} {milliseconds:12.2f}   beyond the limit of"
                f" velocity by {beyond[0]:.1e}, of acceleration by {beyond[1]:.1e}"
            )


def _toppra(
    knots: np.ndarray, points: np.ndarray, limits: MotionLimits, grid: int | None = None
) -> Any:
    """Return TOPP-RA's trajectory along the cubic spline through points."""
    from toppra import SplineInterpolator
    from toppra.algorithm import TOPPRA
    from toppra.constraint import JointAccelerationConstraint, JointVelocityConstraint

    logging.disable(logging.CRITICAL)
    v, a = limits.velocities, limits.accelerations
    instance = TOPPRA(
        [
            JointVelocityConstraint(np.stack([-v, v], axis=1)),
            JointAccelerationConstraint(np.stack([-a, a], axis=1)),
        ],
        SplineInterpolator(knots, points),
        gridpoints=None if grid is None else np.linspace(0.0, 1.0, grid + 1),
        parametrizer="ParametrizeConstAccel",
    )
    return instance.compute_trajectory(0.0, 0.0)


def main() -> None:
    """Print the tables."""
    _straight_ways()
    robots = load_robot_diagram(_SCENE)
    checker = SceneGraphCollisionChecker(robots, env_collision_padding=_PADDING)
    path = plan_path(checker, _START, _GOAL, group="arm").configurations
    moving = robots.tree.group_positions("arm")
    limits = MotionLimits.of_tree(robots.tree, accelerations=_ACCELERATION, positions=moving)
    _corners(path[:, moving], limits)
    print(
        f"\n{'a Panda in its shelf':32} {'CPU, ms':>12} {'takes, s':>10} {'keeps, mm':>10} points"
    )
    for rise_time in (0.0, _RISE_TIME):
        milliseconds, timed = _milliseconds(
            lambda r=rise_time: time_path(checker, path, limits, rise_time=r)
        )
        kept, count = 1e3 * timed.least_clearance, len(timed.points.nanoseconds)
        print(
            f"{f'proven, rise time {rise_time:g} s':32} {milliseconds:12.1f}"
            f" {timed.duration:10.4f} {kept:10.3f} {count}"
        )


if __name__ == "__main__":
    main()
