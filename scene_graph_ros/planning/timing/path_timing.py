"""Trajectories along proven paths: rounded at their corners, timed, and proven once more."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.planning.checker.collision_checker import SceneGraphCollisionChecker
from scene_graph_ros.planning.constraints.link_constraints import LinkConstraint
from scene_graph_ros.planning.edges.edge_stretches import FREE
from scene_graph_ros.planning.parallel.stoppable import Turns
from scene_graph_ros.planning.timing.deviations import far_pieces, too_far
from scene_graph_ros.planning.timing.leading_part import joined, led_out, parts_of
from scene_graph_ros.planning.timing.path_options import (
    of_moving_positions,
    PathOptions,
    with_options,
)
from scene_graph_ros.planning.timing.rounded_path import RoundedPath
from scene_graph_ros.planning.timing.stopping_first import stopping_first
from scene_graph_ros.planning.timing.timing_problem import (
    as_timed_path,
    beyond_limit,
    in_turns,
    not_free,
    not_retimed,
    position_excess,
    rate_or_position_excess,
    TimedPath,
    timing_problem,
    TimingFailure,
    TimingProblem,
    too_late,
)
from scene_graph_ros.trajectories.errors import RetimingError, TrajectoryError
from scene_graph_ros.trajectories.motion_limits import MotionLimits
from scene_graph_ros.trajectories.piecewise_polynomial import PiecewisePolynomial
from scene_graph_ros.trajectories.retimer import Retimer
from scene_graph_ros.trajectories.retimers.named_retimers import as_retimer
from scene_graph_ros.trajectories.sample_along import sample_along
from scene_graph_ros.trajectories.sampling import Sampled, SHORTEST
from scene_graph_ros.trajectories.trajectory_points import TrajectoryPoints

__all__ = ["prove_part", "prove_trajectory", "time_path"]

_DETOUR = 1.1
"""Times the duration of a motion that stops off its path: one that takes longer had better."""

_SLOWER = 1.001
"""Times the duration with rests at all corners: motions that take longer had better rest."""


def time_path(
    checker: SceneGraphCollisionChecker,
    path: ArrayLike,
    limits: MotionLimits,
    *,
    rise_time: float = 0.0,
    retimer: Retimer | str = "time_optimal",
    grid_points: int | None = None,
    start_tolerance: float = 0.0,
    free_from: int = 0,
    constraints: Iterable[LinkConstraint] = (),
    deviation: ArrayLike | None = None,
    through: ArrayLike = (),
    at_rest: ArrayLike = (),
    start_velocity: ArrayLike | None = None,
    start_acceleration: ArrayLike | None = None,
    end_velocity: ArrayLike | None = None,
    end_acceleration: ArrayLike | None = None,
    timeout: float | None = None,
    watch: Callable[[], None] | None = None,
) -> TimedPath:
    """Return a fast trajectory along a path ``(n, nq)`` of straight edges.

    ``limits`` are of the positions that move, by name; all others must be the same on all of the
    path. Corners are rounded, as far as is proven free, and stopped at where they can't be. It
    returns points and the cubics through them, as controllers run them: of these it is shown
    that they keep all limits at all times, and proven that they are free. With limits of jerk
    accelerations do not jump; then points have them, and it is the quintics through them. With a
    ``rise_time`` (s) and no limits of jerk each moment becomes the mean of so much time around it.

    Rounded corners reach at most to the middles of edges. Where the path turns back, by 172
    degrees or more, it is followed to the end, with rest. Points that are on straight edges
    between others, but for rounding to float32 or to 3 to 7 decimals, are no corners.
    Where at least five edges in turn are those of a curve, it is the cubic spline through their
    points, if that is within 0.2 % of the path's extent.
    ``deviation``, one or ``(nq,)`` in the units of q, is how far from the path the trajectory may
    be; 0 rests at each corner. ``through`` are rows of the path that it passes exactly, and
    ``at_rest`` rows at which it rests. Where it can't pass a row of ``through`` on a curve that
    is free, it rests there.

    It begins and ends at rest, or with velocities and accelerations ``(nq,)``; those that are not
    along the first and the last edge take it off these, and accelerations need limits of jerk.
    Where that finds nothing, or only what takes longer, it stops in line first, and goes on from
    there: on the first edge, or off it where no ``deviation`` is given.

    ``retimer`` names the method that finds the speed along the path. ``"time_optimal"`` is our
    own, whose ``grid_points`` (default 32) are stretches of each corner with one speedup each:
    more are faster, and take longer to find. ``"toppra"`` and ``"ruckig"`` are others, or a
    `ToppraRetimer` or `RuckigRetimer` with options; their motions are checked and proven as ours
    are. ``start_tolerance`` (rad or m), ``timeout`` (s) and ``watch`` are as of `plan_path`. A
    `Plan` whose start collides says from which of its configurations on it is free: ``free_from``.
    The trajectory rests there. Before, it is proven that no pair gets deeper than at the start by
    more than 0.01 mm. ``constraints`` are as of `plan_path`, and hold at all times.

    Raises TrajectoryError naming the fault: rows that the path has not, rates beyond
    their limits, a path that moves positions without limits, or turns a floating joint. Raises as
    `SceneGraphCollisionChecker` does for configurations of another shape, and MissingRetimerError
    where a retimer is not installed.
    """
    # Others may change theirs meanwhile.
    chosen = as_retimer(retimer, grid_points)
    problem = timing_problem(checker.clone(), path, limits, rise_time, chosen, constraints)
    asked = PathOptions(
        deviation,
        through,
        at_rest,
        (start_velocity, start_acceleration),
        (end_velocity, end_acceleration),
    )
    problem = with_options(problem, asked)
    problem = problem._replace(start_tolerance=max(float(start_tolerance), 0.0))
    problem = of_moving_positions(problem)
    parts = parts_of(problem, free_from)
    return in_turns(
        lambda turns: led_out(parts, [_timed(part, turns) for part in parts.problems]),
        len(problem.path),
        timeout,
        watch,
    )


def prove_trajectory(
    checker: SceneGraphCollisionChecker,
    points: TrajectoryPoints,
    limits: MotionLimits,
    *,
    constraints: Iterable[LinkConstraint] = (),
    timeout: float | None = None,
    watch: Callable[[], None] | None = None,
) -> TimedPath:
    """Return whether a trajectory of any origin keeps all limits and is free, at all times.

    ``points`` have the configurations of all positions ``(m, nq)``, and velocities. The curves
    looked at are those that controllers run through them: cubics, with accelerations quintics.
    ``limits`` are of the positions that move, by name; those of positions are the robot's. A
    failure says which limit is exceeded, by how much and when, which pair is not proven apart, or
    which of ``constraints``, as of `plan_path`, is not proven to hold.

    ``timeout`` (s) and ``watch`` are as of `plan_path`. Raises TrajectoryError for points without
    velocities, for a single one, and as `time_path` does.
    """
    if points.velocities is None or len(points.positions) < 2:
        raise TrajectoryError("points must be two or more, with velocities")
    problem = timing_problem(checker.clone(), points.positions, limits, constraints=constraints)
    for name in ("velocities", "accelerations"):
        rates = getattr(points, name)
        if rates is not None:
            _demand_rest(problem, name, rates)
    count = len(points.positions)
    return in_turns(
        lambda turns: _judged(problem, points.of(problem.rows), turns), count, timeout, watch
    )


def prove_part(
    checker: SceneGraphCollisionChecker,
    points: TrajectoryPoints,
    limits: MotionLimits,
    constraints: Iterable[LinkConstraint],
    timeout: float | None,
    watch: Callable[[], None],
) -> TimedPath:
    """Return whether what is left of a trajectory is free: `prove_trajectory` without its limits.

    These it kept when it was made, with those of then.
    """
    problem = timing_problem(checker, points.positions, limits, constraints=constraints)
    own = points.of(problem.rows)
    curve = own.trajectory()
    count = len(points.positions)
    return in_turns(lambda turns: _free(problem, own, curve, turns), count, timeout, watch)


def _demand_rest(problem: TimingProblem, name: str, rates: NDArray[np.float64]) -> None:
    """Raise TrajectoryError where a position without limits has a rate."""
    moves = (rates != 0.0).any(axis=0)
    moves[problem.rows] = False
    if moves.any():
        which = problem.checker.plan.tree.position_names[int(np.argmax(moves))]
        raise TrajectoryError(f"{name} of position {which!r} must be 0, as it has no limits")


def _judged(problem: TimingProblem, own: TrajectoryPoints, turns: Turns) -> TimedPath:
    """Return whether the curve through points of all that moves is within limits and free."""
    trajectory = own.trajectory()
    excess = rate_or_position_excess(problem, own, trajectory)
    if excess is not None:
        return beyond_limit(problem, excess)
    return _free(problem, own, trajectory, turns)


def _free(
    problem: TimingProblem,
    own: TrajectoryPoints,
    trajectory: PiecewisePolynomial,
    turns: Turns,
) -> TimedPath:
    """Return whether the curve through points is free, and holds constraints."""
    proofs = problem.prove(trajectory.control_points, turns, may_wait=True)
    if (proofs.statuses == FREE).all():
        return as_timed_path(problem, own, trajectory, proofs, np.empty(0))
    return (
        too_late() if turns.stops.looking[0] != 0 else not_free(problem, trajectory, proofs, None)
    )


def _timed(problem: TimingProblem, turns: Turns) -> TimedPath:
    """Return the trajectory; told to stop, or where a retimer finds none, why.

    One that begins or ends moving stops there, where nothing else is found, or only what takes
    longer.
    """
    found = _on_path(problem, turns)
    if problem.start.is_rest and problem.end.is_rest:
        return found
    stopping = stopping_first(problem)
    if stopping is None or turns.stops.looking[0] != 0:
        return found
    if found.is_success and found.duration <= _DETOUR * stopping.longest:
        return found
    parts = [
        _stop(problem, stopping.lead, turns),
        _on_path(stopping.between, turns),
        _stop(problem, stopping.tail, turns),
    ]
    tried = [each for each in parts if each is not None]
    if not all(each.is_success for each in tried):
        return found
    whole = joined(tried)
    return found if found.is_success and found.duration <= whole.duration else whole


def _stop(
    problem: TimingProblem, points: TrajectoryPoints | None, turns: Turns
) -> TimedPath | None:
    """Return a stop, if it is within limits and free; None where there is none."""
    return None if points is None else _judged(problem, points, turns)


def _on_path(problem: TimingProblem, turns: Turns) -> TimedPath:
    """Return the trajectory along a path; told to stop, or where a retimer finds none, why."""
    try:
        return _retimed(problem, turns)
    except RetimingError as error:
        return not_retimed(f"{error}{_moving_ends(problem)}")


def _moving_ends(problem: TimingProblem) -> str:
    """Return words about how a trajectory is to begin and end: the joint that stops last."""
    limits, words = problem.limits, ""
    for where, rates in (("at 0 s", problem.start), ("at the end", problem.end)):
        if rates.is_rest:
            continue
        velocity, acceleration = rates
        own = velocity if velocity.any() else acceleration
        row = int(np.argmax(np.abs(own) / limits.accelerations))
        words += (
            f"; {where} the velocity of {limits.name(row)!r} is {velocity[row]:.6g}, of at most"
            f" {limits.velocities[row]:.6g}, and its acceleration {acceleration[row]:.6g}, of at"
            f" most {limits.accelerations[row]:.6g}"
        )
        if limits.jerks is not None:
            words += f", which changes by at most {limits.jerks[row]:.6g} per second"
    return words


def _retimed(problem: TimingProblem, turns: Turns) -> TimedPath:
    """Return the trajectory; told to stop, why there is none. Raises RetimingError."""
    found = _along(problem, RoundedPath(problem), turns)
    if found.failure in (TimingFailure.NOT_FREE, TimingFailure.CONSTRAINT):
        # What was left out of the path as rounding may have been what kept it free, or held.
        whole = RoundedPath(problem, leaves_out=False)
        if whole.num_points > RoundedPath(problem).num_points:
            return _along(problem, whole, turns)
    return found


def _along(problem: TimingProblem, rounded: RoundedPath, turns: Turns) -> TimedPath:
    """Return the trajectory along a path whose corners are rounded as far as it is free.

    With rests at all of them, where it is sooner there so.
    """
    if rounded.num_points == 1:
        return _at_rest(problem, rounded.points, turns)
    found = _as_rounded(problem, rounded, turns)
    if not (found.is_success and problem.start.is_rest and problem.end.is_rest):
        return found
    if found.duration > _SLOWER * rounded.duration_with_rests and rounded.rest():
        rested = _as_rounded(problem, rounded, turns)
        if rested.is_success and rested.duration < found.duration:
            return rested
    return found


def _as_rounded(problem: TimingProblem, rounded: RoundedPath, turns: Turns) -> TimedPath:
    """Return the trajectory along a path whose corners are rounded as far as it is free."""
    is_proven = problem.retimer.stops_at_corners
    if not is_proven:
        rounded.sample_sizes(turns)
    while True:
        curve, ends = rounded.curve()
        sampled = sample_along(
            curve,
            problem.limits,
            rise_time=problem.rise_time,
            retimer=problem.retimer,
            ends=ends,
        )
        if sampled.excess is not None:
            return beyond_limit(problem, sampled.excess)
        trajectory = sampled.points.trajectory()
        proofs = problem.prove(trajectory.control_points, turns)
        excess, far = position_excess(problem, trajectory), far_pieces(problem, trajectory)
        bad = (proofs.statuses != FREE) | far
        if excess is None and not bad.any():
            return as_timed_path(problem, sampled.points, trajectory, proofs, rounded.passed())
        if turns.stops.looking[0] != 0:
            return too_late()
        if not is_proven:
            is_proven = True
            if rounded.prove_sizes(turns):
                continue
        times = [] if excess is None else [excess.time]
        at = np.flatnonzero(bad)
        times += (0.5 * (trajectory.breaks[at] + trajectory.breaks[at + 1])).tolist()
        if not rounded.shrink(_places(sampled, times)):
            if far.any() and excess is None:
                return too_far(problem, trajectory, int(np.argmax(far)))
            return not_free(problem, trajectory, proofs, excess)


def _places(sampled: Sampled, times: list[float]) -> NDArray[np.float64]:
    """Return the parameters on the rounded path of a trajectory at times, s."""
    # With a rise time it is at the mean of what was before.
    before = np.array(times) / sampled.factor - 0.5 * sampled.rise_time
    return sampled.motion.time_scaling.value(before)[:, 0]


def _at_rest(problem: TimingProblem, q: NDArray[np.float64], turns: Turns) -> TimedPath:
    """Return the trajectory that stays where it is, for as short as that can be said."""
    if not (problem.start.is_rest and problem.end.is_rest):
        raise RetimingError("the path leads nowhere")
    points = np.repeat(q, 2, axis=0)
    times = np.array([0, round(SHORTEST * 1e9)])
    rates = np.zeros_like(points)
    has_accelerations = problem.rise_time > 0.0 or problem.limits.jerks is not None
    more = rates if has_accelerations else None
    own = TrajectoryPoints(times, points, rates, more)
    trajectory = own.trajectory()
    proofs = problem.prove(trajectory.control_points, turns)
    excess = position_excess(problem, trajectory)
    if turns.stops.looking[0] != 0 and (proofs.statuses != FREE).any():
        return too_late()
    if excess is not None or (proofs.statuses != FREE).any():
        return not_free(problem, trajectory, proofs, excess)
    return as_timed_path(problem, own, trajectory, proofs, np.empty(0))
