"""Trajectories of parts: from rest to rest, and out of a collision to where all is free."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import reduce
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.reals import as_float
from scene_graph_ros.planning.checker.start_overlap import start_overlap_of
from scene_graph_ros.planning.timing.timing_problem import TimedPath, TimingProblem
from scene_graph_ros.trajectories.errors import TrajectoryError
from scene_graph_ros.trajectories.motion_ends import EndRates
from scene_graph_ros.trajectories.piecewise_polynomial import PiecewisePolynomial
from scene_graph_ros.trajectories.trajectory_points import TrajectoryPoints

__all__ = ["Parts", "joined", "led_out", "parts_of"]


class Parts(NamedTuple):
    """The parts of a path that are timed one after another, with rest where they meet."""

    problems: tuple[TimingProblem, ...]
    ends: tuple[int, ...]
    """At which configurations they end."""
    leads: int
    """Up to which one they lead out of a collision."""


def parts_of(problem: TimingProblem, free_from: int) -> Parts:
    """Return the parts of a path: between configurations at rest, and where it gets free.

    Raises TrajectoryError for a ``free_from`` that is no configuration of the path.
    """
    row, path = as_float(free_from), problem.path
    if row is None or not 0.0 <= row < len(path) or not row.is_integer():
        raise TrajectoryError(
            f"free_from must be a configuration of the path, 0 to {len(path) - 1}, not"
            f" {quoted(free_from)}"
        )
    overlap = start_overlap_of(problem.checker, path[0]) if row else None
    leads = int(row) if overlap is not None else 0
    last = len(path) - 1
    rests = np.flatnonzero(problem.at_rest)
    ends = [0, *sorted({leads, *rests.tolist()} - {0, last}), last] if last else [0, 0]
    parts = [_part(problem, low, high) for low, high in pairwise(ends)]
    if overlap is not None:
        parts = [
            part._replace(checker=overlap.checker) if high <= leads else part
            for part, high in zip(parts, ends[1:], strict=True)
        ]
    return Parts(tuple(parts), tuple(ends[1:]), leads)


def _part(problem: TimingProblem, low: int, high: int) -> TimingProblem:
    """Return the part of a problem from one configuration to another."""
    rest = EndRates(*(np.zeros(len(problem.rows)) for _ in range(2)))
    return problem._replace(
        path=problem.path[low : high + 1],
        through=problem.through[low : high + 1],
        start=problem.start if low == 0 else rest,
        end=problem.end if high == len(problem.path) - 1 else rest,
    )


def led_out(parts: Parts, found: Sequence[TimedPath]) -> TimedPath:
    """Return the trajectory of all parts, of which the first ones may lead out."""
    whole = joined(found)
    if not parts.leads or not whole.is_success:
        return whole
    points, least = 0, np.inf
    for each, end in zip(found, parts.ends, strict=True):
        assert each.points is not None
        if end <= parts.leads:
            points += len(each.points.positions) - 1
        else:
            least = min(least, each.least_clearance)
    return replace(whole, least_clearance=least, free_from=points)


def joined(parts: Sequence[TimedPath]) -> TimedPath:
    """Return a trajectory of parts that rest where they meet, or the first failure."""
    failed = next((part for part in parts if not part.is_success), None)
    if failed is not None:
        return failed
    return reduce(_two, parts)


def _two(lead: TimedPath, rest: TimedPath) -> TimedPath:
    """Return a trajectory of two."""
    assert lead.points is not None
    assert rest.points is not None
    assert lead.trajectory is not None
    assert rest.trajectory is not None
    offset = lead.points.nanoseconds[-1]
    points = TrajectoryPoints(
        np.concatenate([lead.points.nanoseconds, rest.points.nanoseconds[1:] + offset]),
        np.concatenate([lead.points.positions, rest.points.positions[1:]]),
        _both(lead.points.velocities, rest.points.velocities),
        _both(lead.points.accelerations, rest.points.accelerations),
    )
    trajectory = PiecewisePolynomial(
        np.concatenate(
            [lead.trajectory.breaks, lead.trajectory.breaks[-1] + rest.trajectory.breaks[1:]]
        ),
        np.concatenate([lead.trajectory.control_points, rest.trajectory.control_points]),
    )
    return replace(
        rest,
        points=points,
        trajectory=trajectory,
        rounded=lead.rounded + rest.rounded,
        least_clearance=min(lead.least_clearance, rest.least_clearance),
        stops=lead.stops + rest.stops + 1,
    )


def _both(
    first: NDArray[np.float64] | None, second: NDArray[np.float64] | None
) -> NDArray[np.float64] | None:
    """Return rates of both parts; they rest where they meet."""
    return None if first is None or second is None else np.concatenate([first, second[1:]])
