"""How long it takes to time paths, and how far from the fastest they are.

``python -m benchmarks.trajectories`` prints processor times of one thread, and durations beside
exact ones: those of straight ways, which are known, and of corners that are cut into many more
stretches. TOPP-RA's own implementation and Ruckig take part where ``toppra`` and ``ruckig`` are
installed, as they are for the tests. What they make is checked and proven as ours is.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec
from itertools import pairwise, product
import logging
from typing import Any

import numpy as np

from benchmarks.timing import least_time
from scene_graph_ros.planning import (
    load_robot_diagram,
    plan_path,
    prove_trajectory,
    RuckigRetimer,
    SceneGraphCollisionChecker,
    time_path,
    TimedPath,
    ToppraRetimer,
)
from scene_graph_ros.planning.trajectories import (
    MotionLimits,
    PiecewisePolynomial,
    retime,
    TrajectoryPoints,
)
from scene_graph_ros.trajectories.corners import CornerPath
from scene_graph_ros.trajectories.retimer import Retimer, TimeOptimalRetimer
from scene_graph_ros.trajectories.sample_along import sample_along
from scene_graph_ros.trajectories.sampling import sample

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
_JERK = 50.0


def _milliseconds(function: Callable[[], Any]) -> tuple[float, Any]:
    """Return the least processor time of a call, and what it returned."""
    seconds, result = least_time(function, 1 + _REPEATS)
    return 1e3 * seconds, result


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


def _with_jerks() -> None:
    """Print how much longer straight ways take with limits of jerk, beside Ruckig's."""
    v, a = 2.0, 5.0
    print(f"\n{'a straight way, rad, jerk':32} {'Ruckig, s':>12} {'ours, longer by':>16}")
    for jerk, way in product((50.0, 500.0), (10.0, 1.0, 0.1, 1e-2, 1e-3)):
        limits = MotionLimits([v, v], [a, a], (), [jerk, jerk])
        ends = np.array([[0.0, 0.0], [way, 0.5 * way]])
        line = PiecewisePolynomial.first_order_hold([0.0, 1.0], ends)
        ours = sample_along(line, limits, retimer=TimeOptimalRetimer()).points.duration
        least = _ruckig(*ends, limits).duration if find_spec("ruckig") else np.nan
        print(f"{f'{way:g}, {jerk:g}':32} {least:12.6g} {ours / least - 1.0:16.1e}")


def _ruckig(start: np.ndarray, goal: np.ndarray, limits: MotionLimits) -> Any:
    """Return Ruckig's trajectory between two configurations, straight, from rest to rest."""
    import ruckig

    asked = ruckig.InputParameter(len(start))
    asked.current_position, asked.target_position = list(start), list(goal)
    asked.max_velocity = limits.velocities.tolist()
    asked.max_acceleration = limits.accelerations.tolist()
    asked.max_jerk = np.asarray(limits.jerks).tolist()
    asked.synchronization = ruckig.Synchronization.Phase
    found = ruckig.Trajectory(len(start))
    ruckig.Ruckig(len(start)).calculate(asked, found)
    return found


def _print_timed(what: str, milliseconds: float, timed: TimedPath) -> None:
    """Print how long it took to time a path, and what came of it."""
    kept, count = 1e3 * timed.least_clearance, len(timed.points.nanoseconds)
    print(f"{what:32} {milliseconds:12.1f} {timed.duration:10.4f} {kept:10.3f} {count}")


def _by_retimers(
    checker: SceneGraphCollisionChecker,
    path: np.ndarray,
    limits: MotionLimits,
    soft: MotionLimits,
) -> None:
    """Print the same for TOPP-RA and Ruckig in the place of our own retimer."""
    asked: list[tuple[str, str, Retimer]] = [
        (f"toppra, {grid} stretches", "toppra", ToppraRetimer(grid)) for grid in (16, 50, 200)
    ]
    asked += [
        ("toppra along a spline", "toppra", ToppraRetimer(along="spline")),
        ("ruckig", "ruckig", RuckigRetimer()),
    ]
    for (what, library, retimer), within in product(asked, (limits, soft)):
        if find_spec(library):
            milliseconds, timed = _milliseconds(
                lambda r=retimer, w=within: time_path(checker, path, w, retimer=r)
            )
            name = what if within is limits else f"{what}, that jerk"
            if timed.is_success:
                _print_timed(name, milliseconds, timed)
            else:
                print(f"{name:32} {milliseconds:12.1f}  {timed.failure.name}: {timed.reason}")


def _foreign(
    checker: SceneGraphCollisionChecker, path: np.ndarray, limits: MotionLimits, rows: np.ndarray
) -> None:
    """Print whether TOPP-RA's trajectories along a path are within limits and free."""
    knots = np.linspace(0.0, 1.0, len(path))
    for grid in (50, 1000):
        for slower in (1.0, 1.01):
            found = _toppra(knots, path[:, rows], limits, grid)
            steps = np.linspace(0.0, found.duration, 4 * grid + 1)
            nanoseconds = np.rint(steps * 1e9 * slower).astype(np.int64)
            times = np.minimum(nanoseconds * 1e-9 / slower, found.duration)
            q = np.repeat(path[:1], len(times), axis=0)
            v = np.zeros_like(q)
            q[:, rows], v[:, rows] = found(times), found(times, 1) / slower
            v[[0, -1]] = 0.0
            points = TrajectoryPoints(nanoseconds, q, v)
            milliseconds, proven = _milliseconds(
                lambda p=points: prove_trajectory(checker, p, limits)
            )
            what = f"toppra, grid {grid}, {slower:g} x as slow"
            print(f"{what:32} {milliseconds:12.1f} {points.duration:10.4f}  {proven.reason}")


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
    _with_jerks()
    robots = load_robot_diagram(_SCENE)
    checker = SceneGraphCollisionChecker(robots, env_collision_padding=_PADDING)
    path = plan_path(checker, _START, _GOAL, group="arm").configurations
    moving = robots.tree.group_positions("arm")
    limits = MotionLimits.of_tree(robots.tree, accelerations=_ACCELERATION, positions=moving)
    _corners(path[:, moving], limits)
    print(
        f"\n{'a Panda in its shelf':32} {'CPU, ms':>12} {'takes, s':>10} {'keeps, mm':>10} points"
    )
    soft = MotionLimits(
        limits.velocities, limits.accelerations, limits.names, np.full(len(moving), _JERK)
    )
    for what, rise_time, within in (
        ("proven, rise time 0 s", 0.0, limits),
        (f"proven, rise time {_RISE_TIME:g} s", _RISE_TIME, limits),
        (f"proven, jerk {_JERK:g} rad/s^3", 0.0, soft),
    ):
        milliseconds, timed = _milliseconds(
            lambda r=rise_time, w=within: time_path(checker, path, w, rise_time=r)
        )
        _print_timed(what, milliseconds, timed)
    _by_retimers(checker, path, limits, soft)
    if find_spec("ruckig"):
        edges = list(pairwise(path[:, moving]))
        milliseconds, found = _milliseconds(lambda: [_ruckig(*e, soft) for e in edges])
        duration = sum(each.duration for each in found)
        print(f"{'Ruckig, edge by edge, that jerk':32} {milliseconds:12.1f} {duration:10.4f}")
    if find_spec("toppra"):
        print(f"\n{'along the spline through it':32} {'proof, ms':>12} {'takes, s':>10}")
        _foreign(checker, path, limits, moving)


if __name__ == "__main__":
    main()
