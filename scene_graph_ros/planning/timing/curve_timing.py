"""Trajectories along curves, such as those through regions: timed, and proven once more."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import ArrayLike

from scene_graph_ros.geometry.real_arrays import real_array
from scene_graph_ros.planning.checker.collision_checker import SceneGraphCollisionChecker
from scene_graph_ros.planning.constraints.link_constraints import LinkConstraint
from scene_graph_ros.planning.edges.edge_stretches import FREE
from scene_graph_ros.planning.parallel.stoppable import Turns
from scene_graph_ros.planning.timing.timing_problem import (
    as_timed_path,
    beyond_limit,
    in_turns,
    not_free,
    not_retimed,
    position_excess,
    TimedPath,
    timing_problem,
    TimingProblem,
    too_late,
)
from scene_graph_ros.robots.tree_joint import KinematicTreeError
from scene_graph_ros.trajectories.bezier_curve import BezierCurve
from scene_graph_ros.trajectories.composite_trajectory import CompositeTrajectory
from scene_graph_ros.trajectories.errors import RetimingError, TrajectoryError
from scene_graph_ros.trajectories.motion_limits import MotionLimits
from scene_graph_ros.trajectories.path_parameterized_trajectory import (
    PathParameterizedTrajectory,
)
from scene_graph_ros.trajectories.piecewise_polynomial import PiecewisePolynomial
from scene_graph_ros.trajectories.polynomials_of import Polynomials, polynomials_of
from scene_graph_ros.trajectories.retimer import Retimer
from scene_graph_ros.trajectories.retimers.named_retimers import as_retimer
from scene_graph_ros.trajectories.sample_along import sample_along
from scene_graph_ros.trajectories.unwrapping import normalize_segment_times

__all__ = ["time_curve"]

_STILL = 1e-9
"""Relative to the size of the curve: a segment that is shorter leads nowhere."""

_DOUBLINGS = 3
"""Of the stretches that were asked for: where nearer points are not proven free, none are."""


def time_curve(
    checker: SceneGraphCollisionChecker,
    curve: Polynomials,
    limits: MotionLimits,
    *,
    at: ArrayLike,
    rise_time: float = 0.0,
    retimer: Retimer | str = "time_optimal",
    grid_points: int | None = None,
    constraints: Iterable[LinkConstraint] = (),
    timeout: float | None = None,
    watch: Callable[[], None] | None = None,
) -> TimedPath:
    """Return a fast trajectory along a curve, from rest to rest, proven free at all times.

    ``curve`` has one row for each position that ``limits`` name, in their order; all others are as
    in ``at`` ``(nq,)``. Of a `CompositeTrajectory` of Bézier curves, such as one through regions,
    the way counts, not its times: its segments are taken as paths r(s). The trajectory stops where
    the direction jumps. The answer has points and the cubics through them, or quintics, as
    of `time_path`: of these it is shown that they keep all limits at all times, and proven that
    they are free. Where they are not, points are set more densely along the curve, twice, four and
    eight times.

    All other arguments, the answer and the errors are as of `time_path`; raises
    TrajectoryError for a curve of other rows than the limits, one that jumps, and one that is no
    polynomials.
    """
    problem = timing_problem(
        checker.clone(),
        real_array(at, "at must be numbers (nq,)", KinematicTreeError)[np.newaxis],
        limits,
        rise_time,
        as_retimer(retimer, grid_points),
        constraints,
    )
    if isinstance(curve, CompositeTrajectory) and all(
        isinstance(segment, BezierCurve) for segment in curve.segments
    ):
        curve = normalize_segment_times(curve)
    curve = polynomials_of("curve", curve)
    if curve.rows != len(problem.limits.names):
        raise TrajectoryError(
            f"curve has {curve.rows} rows, and limits name {len(problem.limits.names)} positions"
        )
    path = _moving(curve)
    return in_turns(lambda turns: _timed(problem, path, turns), len(path.breaks), timeout, watch)


def _moving(curve: PiecewisePolynomial) -> PiecewisePolynomial:
    """Return a curve without the segments that lead nowhere. Raises TrajectoryError if all do."""
    points = np.array(curve.control_points)
    size = float(np.abs(points).max())
    moves = (np.ptp(points, axis=1) > _STILL * size).any(axis=1)
    if not moves.any():
        raise TrajectoryError("curve leads nowhere: it stays where it is")
    widths = np.diff(curve.breaks)[moves]
    kept = points[moves]
    kept[0, 0], kept[-1, -1] = points[0, 0], points[-1, -1]
    between = points[1:, 0] - points[:-1, -1]
    if (np.abs(between) > _STILL * size).any():
        raise TrajectoryError("curve jumps between two of its segments")
    kept[1:, 0] = kept[:-1, -1]
    breaks = curve.breaks[0] + np.concatenate([[0.0], widths.cumsum()])
    return PiecewisePolynomial(breaks, kept)


def _timed(problem: TimingProblem, path: PiecewisePolynomial, turns: Turns) -> TimedPath:
    """Return the trajectory; told to stop, or where a retimer finds none, why."""
    try:
        return _retimed(problem, path, turns)
    except RetimingError as error:
        return not_retimed(str(error))


def _retimed(problem: TimingProblem, path: PiecewisePolynomial, turns: Turns) -> TimedPath:
    """Return the trajectory; told to stop, why there is none. Raises RetimingError."""
    retimer, doublings = problem.retimer, 0
    while True:
        sampled = sample_along(path, problem.limits, rise_time=problem.rise_time, retimer=retimer)
        if sampled.excess is not None:
            return beyond_limit(problem, sampled.excess)
        trajectory = sampled.points.trajectory()
        proofs = problem.prove(trajectory.control_points, turns)
        excess = position_excess(problem, trajectory)
        if excess is None and (proofs.statuses == FREE).all():
            rests = np.zeros(_count_rests(sampled.motion))
            return as_timed_path(problem, sampled.points, trajectory, proofs, rests)
        if turns.stops.looking[0] != 0:
            return too_late()
        if doublings == _DOUBLINGS:
            return not_free(problem, trajectory, proofs, excess)
        retimer, doublings = retimer.finer(), doublings + 1


def _count_rests(motion: PathParameterizedTrajectory) -> int:
    """Return the number of rests of a motion between its ends."""
    points = motion.time_scaling.control_points[:, :, 0]
    # Where it begins a stretch at rest; with a rise time it first stays there for a stretch.
    begins = points[1:, 1] == points[1:, 0]
    stays = points[1:, -1] == points[1:, 0]
    return int((begins & ~stays).sum())
