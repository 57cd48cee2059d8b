"""Trajectories of fewer points, for messages and controllers with room for no more."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.number_checks import positive, whole
from scene_graph_ros.planning.checker.collision_checker import SceneGraphCollisionChecker
from scene_graph_ros.planning.constraints.link_constraints import LinkConstraint
from scene_graph_ros.planning.edges.edge_stretches import FREE
from scene_graph_ros.planning.parallel.stoppable import Turns
from scene_graph_ros.planning.timing.timing_problem import (
    beyond_limit,
    constraint_failure,
    in_turns,
    not_free,
    rate_or_position_excess,
    TimedPath,
    timing_problem,
    TimingProblem,
    too_late,
    too_many_points,
)
from scene_graph_ros.trajectories.errors import TrajectoryError
from scene_graph_ros.trajectories.motion_limits import LimitExcess, MotionLimits
from scene_graph_ros.trajectories.path_parameterized_trajectory import (
    PathParameterizedTrajectory,
)
from scene_graph_ros.trajectories.sampling import slowed, States
from scene_graph_ros.trajectories.thinning_kernels import keep_points
from scene_graph_ros.trajectories.trajectory_points import TrajectoryPoints

__all__ = ["thin_trajectory"]

_HALVES = 12
"""Of the interval of tolerances, by logarithms."""

_FASTER = 0.01
"""Of a limit: by how much polynomials may exceed it before all is slowed down."""

_LEAST = 1e-9
"""Of the largest tolerance: the least that is tried."""


def thin_trajectory(
    checker: SceneGraphCollisionChecker,
    timed: TimedPath,
    limits: MotionLimits,
    max_points: int,
    *,
    deviation: float = 1e-3,
    constraints: Iterable[LinkConstraint] = (),
    timeout: float | None = None,
    watch: Callable[[], None] | None = None,
) -> TimedPath:
    """Return a trajectory of at most ``max_points`` points in place of one that has more.

    Points are left out. The polynomials through the remaining ones are within ``deviation`` (rad
    or m) of those before, in each position and at each share of the duration; ``thinned_by`` of
    the answer says how near they are. From rest to rest it takes up to 1 % longer, to keep
    ``limits``. They are proven free, and to hold ``constraints``, as of `time_path`, whose
    ``timeout`` and ``watch`` these are.
    Points at rest and ``free_from`` are kept. A trajectory that has no more points, and one that
    is a failure, is returned as it is.

    Failures are those of `time_path`, and TOO_MANY_POINTS where so few are not within
    ``deviation``. Raises TrajectoryError for numbers that make no sense.
    """
    count = whole("max_points", max_points, TrajectoryError, 2)
    most = positive("deviation", deviation, TrajectoryError)
    if timed.points is None or len(timed.points.positions) <= count:
        return timed
    points = timed.points
    problem = timing_problem(checker.clone(), points.positions, limits, constraints=constraints)
    always = np.zeros(len(points.positions), dtype=np.bool_)
    if points.velocities is not None:
        always[~points.velocities.any(axis=1)] = True
    always[timed.free_from] = True

    def job(turns: Turns) -> TimedPath:
        return _thinned(problem, timed, points, always, (count, most), turns)

    return in_turns(job, len(points.positions), timeout, watch)


def _thinned(
    problem: TimingProblem,
    timed: TimedPath,
    points: TrajectoryPoints,
    always: NDArray[np.bool_],
    most: tuple[int, float],
    turns: Turns,
) -> TimedPath:
    """Return the trajectory through fewer points, or why there is none."""
    count, deviation = most
    kept = _kept(problem, points, always, deviation)
    if kept.sum() > count:
        words = (
            f"{len(kept)} points can't be thinned to {count} within {deviation:g} rad or m:"
            f" {int(kept.sum())} are left"
        )
        return too_many_points(words)
    low, high = _LEAST * deviation, deviation
    for _ in range(_HALVES):
        middle = float(np.sqrt(low * high))
        tried = _kept(problem, points, always, middle)
        if tried.sum() > count:
            low = middle
        else:
            high, kept = middle, tried
    thinned, excess = _slowed(problem, points, kept)
    if excess is not None:
        return beyond_limit(problem, excess)
    trajectory = thinned.of(problem.rows).trajectory()
    excess = rate_or_position_excess(problem, points, trajectory)
    if excess is not None:
        return beyond_limit(problem, excess)
    broken = constraint_failure(problem, trajectory)
    if broken is not None:
        return broken
    free_from = int(kept[: timed.free_from].sum())
    proofs = problem.prove(trajectory.control_points[free_from:], turns)
    if (proofs.statuses != FREE).any():
        if turns.stops.looking[0] != 0:
            return too_late()
        return not_free(problem, trajectory, proofs, None)
    return replace(
        timed,
        points=thinned,
        trajectory=thinned.trajectory(),
        least_clearance=max(float(proofs.numbers[:, 2].min(initial=np.inf)), 0.0),
        free_from=free_from,
        thinned_by=high,
    )


def _slowed(
    problem: TimingProblem, points: TrajectoryPoints, kept: NDArray[np.bool_]
) -> tuple[TrajectoryPoints, LimitExcess | None]:
    """Return the points that are kept, so much slower that these are within the limits."""
    q = points.positions[kept]
    times = points.nanoseconds[kept].astype(np.float64) * 1e-9
    v = np.zeros_like(q) if points.velocities is None else points.velocities[kept]
    a = None if points.accelerations is None else points.accelerations[kept]

    def states_at(_: NDArray[np.int64], factor: float) -> States:
        rows = problem.rows
        return q[:, rows], v[:, rows] / factor, None if a is None else a[:, rows] / factor**2

    found = slowed(times, states_at, problem.limits, _no_motion)
    factor, nanoseconds = found.factor, found.points.nanoseconds
    slower = None if a is None else a / factor**2
    return TrajectoryPoints(nanoseconds, q, v / factor, slower), found.excess


def _no_motion() -> PathParameterizedTrajectory:
    raise AssertionError("points alone are slowed down")


def _moves_at_ends(points: TrajectoryPoints) -> bool:
    """Tell whether what is slowed down would begin or end otherwise."""
    rates = (points.velocities, points.accelerations)
    return any(each is not None and bool(each[[0, -1]].any()) for each in rates)


def _kept(
    problem: TimingProblem,
    points: TrajectoryPoints,
    always: NDArray[np.bool_],
    tolerance: float,
) -> NDArray[np.bool_]:
    """Return a mask of the points that are kept within a tolerance."""
    limits, rows = problem.limits, problem.rows
    given = (limits.velocities, limits.accelerations, limits.jerks)
    most = np.stack([each for each in given if each is not None])
    if not _moves_at_ends(points):
        most *= 1.0 + _FASTER
    kept = np.zeros(len(always), dtype=np.bool_)
    q = np.ascontiguousarray(points.positions[:, rows])
    v, a = (
        np.zeros_like(q) if each is None else np.ascontiguousarray(each[:, rows])
        for each in (points.velocities, points.accelerations)
    )
    is_quintic = points.accelerations is not None
    times = points.nanoseconds * 1e-9
    keep_points(times, q, v, a, is_quintic, most, tolerance, always, kept)
    return kept
