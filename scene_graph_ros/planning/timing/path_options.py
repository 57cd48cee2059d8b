"""Options of how a path is followed, checked."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.real_arrays import real_array, whole_array
from scene_graph_ros.planning.timing.timing_problem import TimingProblem
from scene_graph_ros.trajectories.errors import TrajectoryError
from scene_graph_ros.trajectories.limit_rounding import LIMIT_ROUNDING
from scene_graph_ros.trajectories.motion_ends import EndRates
from scene_graph_ros.trajectories.motion_limits import MotionLimits

__all__ = ["PathOptions", "of_moving_positions", "with_options"]

_ROUNDING = 1e-9
"""Relative: a rate that is beyond its limit by less is at it."""


class PathOptions(NamedTuple):
    """As given to `time_path`."""

    deviation: ArrayLike | None
    through: ArrayLike
    at_rest: ArrayLike
    start: tuple[ArrayLike | None, ArrayLike | None]
    """Velocity and acceleration."""
    end: tuple[ArrayLike | None, ArrayLike | None]


def with_options(problem: TimingProblem, asked: PathOptions) -> TimingProblem:
    """Return a problem with its options. Raises TrajectoryError naming a wrong option."""
    return problem._replace(
        deviation=_deviation(problem, asked.deviation),
        through=_rows(problem, "through", asked.through),
        at_rest=_rows(problem, "at_rest", asked.at_rest),
        start=_rates(problem, "start", asked.start),
        end=_rates(problem, "end", asked.end),
    )


def of_moving_positions(problem: TimingProblem) -> TimingProblem:
    """Return a problem without the positions that its path leaves where they are.

    Those that are beyond their limits there, or are to move at an end, remain.
    """
    tree, rows, limits = problem.checker.plan.tree, problem.rows, problem.limits
    q, slack = problem.path[:, rows], problem.start_tolerance + LIMIT_ROUNDING
    moves = np.ptp(q, axis=0) > 0.0
    if not moves.any():
        return problem
    moves |= (q[0] < tree.lower[rows] - slack) | (q[0] > tree.upper[rows] + slack)
    for rates in (*problem.start, *problem.end):
        moves |= rates != 0.0
    if moves.all():
        return problem
    kept = np.flatnonzero(moves)
    own = MotionLimits(
        limits.velocities[kept],
        limits.accelerations[kept],
        tuple(limits.names[k] for k in kept),
        None if limits.jerks is None else limits.jerks[kept],
    )
    return problem._replace(
        rows=rows[kept],
        limits=own,
        deviation=None if problem.deviation is None else problem.deviation[kept],
        start=EndRates(*(rates[kept] for rates in problem.start)),
        end=EndRates(*(rates[kept] for rates in problem.end)),
    )


def _deviation(problem: TimingProblem, given: ArrayLike | None) -> NDArray[np.float64] | None:
    """Return a deviation of each position that moves, or None."""
    if given is None:
        return None
    nq = problem.path.shape[1]
    rule = f"deviation must be one number from 0 on, or one of each position ({nq},)"
    values = real_array(given, rule, TrajectoryError)
    if values.shape not in ((), (nq,)) or not (values >= 0.0).all():
        raise TrajectoryError(f"{rule}, not {quoted(given)}")
    result: NDArray[np.float64] = np.broadcast_to(values, (nq,))[problem.rows]
    return result


def _rows(problem: TimingProblem, name: str, given: ArrayLike) -> NDArray[np.bool_]:
    """Return a mask ``(n,)`` of the named rows of the path."""
    count = len(problem.path)
    result = np.zeros(count, dtype=np.bool_)
    if isinstance(given, tuple) and not given:
        return result
    rule = f"{name} must be rows of the path, 0 to {count - 1}"
    rows = whole_array(given, rule, TrajectoryError)
    if rows.size == 0:
        return result
    if rows.ndim != 1 or not ((rows >= 0) & (rows < count)).all():
        raise TrajectoryError(f"{rule}, not {quoted(given)}")
    result[rows] = True
    return result


def _rates(
    problem: TimingProblem, end: str, given: tuple[ArrayLike | None, ArrayLike | None]
) -> EndRates:
    """Return the velocity and the acceleration of the positions that move at an end."""
    limits, nq = problem.limits, problem.path.shape[1]
    if all(each is None for each in given):
        return EndRates(*np.zeros((2, len(problem.rows))))
    rates = []
    for kind, most, each in zip(
        ("velocity", "acceleration"),
        (limits.velocities, limits.accelerations),
        given,
        strict=True,
    ):
        name, values = f"{end}_{kind}", np.zeros(nq)
        if each is not None:
            values = real_array(each, f"{name} must be numbers ({nq},)", TrajectoryError)
        if values.shape != (nq,) or not np.isfinite(values).all():
            raise TrajectoryError(f"{name} must be finite numbers ({nq},), not {quoted(each)}")
        others = np.delete(values, problem.rows)
        if others.any():
            raise TrajectoryError(f"{name} must be 0 where a position has no limits")
        own = values[problem.rows]
        beyond = np.abs(own) > most * (1.0 + _ROUNDING)
        if beyond.any():
            i = int(np.argmax(beyond))
            raise TrajectoryError(
                f"{name} of {limits.name(i)!r} is {own[i]:.10g}, beyond its limit {most[i]:.10g}"
            )
        rates.append(own)
    if limits.jerks is None and rates[1].any():
        raise TrajectoryError(
            f"{end}_acceleration needs limits of jerk: without these accelerations may jump"
        )
    return EndRates(*rates)
