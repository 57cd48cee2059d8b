"""Trajectories that lead out of a collision: a part to where all is free, and one from there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.reals import as_float
from scene_graph_ros.planning.checker.start_overlap import start_overlap_of
from scene_graph_ros.planning.timing.timing_problem import TimedPath, TimingProblem
from scene_graph_ros.trajectories.errors import TrajectoryError
from scene_graph_ros.trajectories.piecewise_polynomial import PiecewisePolynomial
from scene_graph_ros.trajectories.trajectory_points import TrajectoryPoints

__all__ = ["joined", "led_out", "parts_of"]


def parts_of(problem: TimingProblem, free_from: int) -> tuple[TimingProblem, ...]:
    """Return the parts of a path that are timed one after another, from rest to rest.

    Raises TrajectoryError for a ``free_from`` that is no configuration of the path.
    """
    row, path = as_float(free_from), problem.path
    if row is None or not 0.0 <= row < len(path) or not row.is_integer():
        raise TrajectoryError(
            f"free_from must be a configuration of the path, 0 to {len(path) - 1}, not"
            f" {quoted(free_from)}"
        )
    overlap = start_overlap_of(problem.checker, path[0]) if row else None
    if overlap is None:
        return (problem,)
    k = int(row)
    leading = problem._replace(path=path[: k + 1], checker=overlap.checker)
    return leading, problem._replace(path=path[k:])


def led_out(parts: Sequence[TimedPath]) -> TimedPath:
    """Return the trajectory of the parts of `parts_of`, of which a first one leads out."""
    whole = joined(parts)
    if len(parts) == 1 or not whole.is_success:
        return whole
    lead, rest = parts
    assert lead.points is not None
    return replace(
        whole, least_clearance=rest.least_clearance, free_from=len(lead.points.positions) - 1
    )


def joined(parts: Sequence[TimedPath]) -> TimedPath:
    """Return a trajectory of one or two parts; that of the first that failed, where one did."""
    failed = next((part for part in parts if not part.is_success), None)
    if failed is not None or len(parts) == 1:
        return failed or parts[0]
    (lead, rest), offset = parts, parts[0].points.nanoseconds[-1]  # type: ignore[union-attr]
    assert lead.points is not None
    assert rest.points is not None
    assert lead.trajectory is not None
    assert rest.trajectory is not None
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
