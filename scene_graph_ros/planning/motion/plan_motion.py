"""The fastest motion that a path leads to: a spline that begins along it, proven."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.planning.edges.edge_stretches import FREE
from scene_graph_ros.planning.motion.spline_motion import (
    first_spline,
    good_duration,
    Sampling,
    shorter_splines,
    Spline,
    SplineRoom,
)
from scene_graph_ros.planning.parallel.stoppable import Turns
from scene_graph_ros.planning.timing.timing_problem import (
    as_timed_path,
    position_excess,
    rate_or_position_excess,
    TimedPath,
    TimingProblem,
)
from scene_graph_ros.trajectories.piecewise_polynomial import PiecewisePolynomial
from scene_graph_ros.trajectories.sample_along import sample_along
from scene_graph_ros.trajectories.sampling import SHORTEST
from scene_graph_ros.trajectories.straight_motion import least_duration
from scene_graph_ros.trajectories.trajectory_points import TrajectoryPoints

__all__ = ["least_time", "spline_motion"]

_REPAIRS = 3
"""How often places are added where a spline is not proven free."""

_SLOWER = 4
"""How often a spline is slowed down by what rounding leaves beyond a limit."""

_SPARE = 1e-12
"""By how much more that is than enough."""

_MOST_SECONDS = 1e6
"""Between two knots: splines of slower motions have no times in a message."""


def least_time(problem: TimingProblem) -> float:
    """Return the least time (s) that start and goal allow, obstacles left aside."""
    ways = problem.path[-1, problem.rows] - problem.path[0, problem.rows]
    return least_duration(ways, problem.limits)


def spline_motion(problem: TimingProblem, turns: Turns) -> TimedPath | None:
    """Return a motion from rest to rest that begins along a path and gets shorter, proven.

    None where no spline is proven free, and where it is time to stop before one is.
    """
    room = _room(problem)
    if not len(room.rows):
        return None
    least, spline = least_time(problem), first_spline(room, problem.path[:, room.rows])
    if not SHORTEST < spline.seconds < _MOST_SECONDS:
        return None
    good = good_duration(room, spline, least)
    sampling, known = Sampling.even(room, spline.spans), None
    for _ in range(_REPAIRS):
        splines = shorter_splines(sampling, spline, good, turns)
        if known is None:
            splines.insert(0, spline)
        tries: list[_Tried] = []
        for each in reversed(splines):
            tries.append(_tried(problem, room, each, turns))
            if tries[-1].motion is not None or turns.stops.proving[0] != 0:
                break
        if not tries or tries[-1].motion is None:
            return known
        known, spline = tries[-1].motion, tries[-1].spline
        if len(tries) == 1:
            break
        sampling = sampling.denser(np.any([each.is_bad for each in tries], axis=0))
    if known is not None and problem.limits.jerks is None:
        return _retimed(problem, room, spline, turns) or known
    return known


def _retimed(
    problem: TimingProblem, room: SplineRoom, spline: Spline, turns: Turns
) -> TimedPath | None:
    """Return the fastest motion along a spline's curve, where accelerations may jump, or None."""
    curve = np.empty((spline.spans, 4, len(problem.rows)))
    curve[:] = problem.path[0, problem.rows]
    curve[:, :, room.moves[problem.rows]] = spline.bezier()
    curve[0, 0], curve[-1, -1] = problem.path[0, problem.rows], problem.path[-1, problem.rows]
    path = PiecewisePolynomial(np.arange(spline.spans + 1.0), curve)
    sampled = sample_along(path, problem.limits, retimer=problem.retimer)
    if sampled.excess is not None:
        return None
    trajectory = sampled.points.trajectory()
    if position_excess(problem, trajectory) is not None:
        return None
    proofs = problem.prove(trajectory.control_points, turns)
    if (proofs.statuses != FREE).any() or trajectory.duration >= spline.duration:
        return None
    return as_timed_path(problem, sampled.points, trajectory, proofs, np.empty(0))


def _room(problem: TimingProblem) -> SplineRoom:
    """Return the room of a spline: the positions that the path moves, and their limits."""
    path, tree, limits = problem.path, problem.checker.plan.tree, problem.limits
    moves = np.ptp(path[:, problem.rows], axis=0) > 0.0
    rows = problem.rows[moves]
    own = [limits.velocities, limits.accelerations]
    if limits.jerks is not None:
        own.append(limits.jerks)
    ends = path[[0, -1]][:, rows]
    lower = np.minimum(tree.lower[rows], ends.min(axis=0))
    upper = np.maximum(tree.upper[rows], ends.max(axis=0))
    return SplineRoom(problem.checker.plan, path[0], rows, np.stack(own)[:, moves], lower, upper)


class _Tried(NamedTuple):
    """A spline, and whether it is a motion."""

    spline: Spline
    motion: TimedPath | None
    is_bad: NDArray[np.bool_]
    """``(s,)``: which intervals are not proven free."""


def _tried(problem: TimingProblem, room: SplineRoom, spline: Spline, turns: Turns) -> _Tried:
    """Return the motion of a spline, if it keeps all limits and is proven free."""
    nothing = np.zeros(spline.spans, dtype=np.bool_)
    sampled = _sampled(problem, room, spline)
    if sampled is None:
        return _Tried(spline, None, nothing)
    points, trajectory = sampled

    proven = problem.prove(trajectory.control_points, turns)
    is_bad = proven.statuses != FREE
    if is_bad.any():
        return _Tried(spline, None, is_bad)
    motion = as_timed_path(problem, points, trajectory, proven, np.empty(0))
    return _Tried(spline, motion, nothing)


def _sampled(
    problem: TimingProblem, room: SplineRoom, spline: Spline
) -> tuple[TrajectoryPoints, PiecewisePolynomial] | None:
    """Return a spline's points at whole nanoseconds, and their polynomials; None: it can't.

    They are of all that has limits, and within them.
    """
    path, moves = problem.path[:, problem.rows], room.moves[problem.rows]
    seconds = spline.seconds
    for _ in range(_SLOWER):
        step = max(math.ceil(seconds * 1e9), 1)
        states = spline._replace(seconds=step * 1e-9).states()
        whole = [np.zeros((spline.spans + 1, len(moves))) for _ in states]
        whole[0][:] = path[0]
        for each, own in zip(whole, states, strict=True):
            each[:, moves] = own
        whole[0][[0, -1]] = path[[0, -1]]
        accelerations = None if problem.limits.jerks is None else whole[2]
        times = step * np.arange(spline.spans + 1)
        points = TrajectoryPoints(times, whole[0], whole[1], accelerations)
        trajectory = points.trajectory()
        excess = rate_or_position_excess(problem, points, trajectory)
        if excess is None:
            return points, trajectory
        if excess.kind == "position" or not excess.ratio < math.inf:
            break
        order = ("velocity", "acceleration", "jerk").index(excess.kind) + 1
        seconds = step * 1e-9 * excess.ratio ** (1.0 / order) * (1.0 + _SPARE)
    return None
