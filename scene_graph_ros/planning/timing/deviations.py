"""Where a trajectory is farther from its path than it may be."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.planning.timing.timing_problem import (
    beyond_limit,
    TimedPath,
    TimingProblem,
)
from scene_graph_ros.trajectories.deviation_kernels import find_far_pieces
from scene_graph_ros.trajectories.limit_rounding import LIMIT_ROUNDING
from scene_graph_ros.trajectories.motion_limits import LimitExcess
from scene_graph_ros.trajectories.piecewise_polynomial import PiecewisePolynomial

__all__ = ["far_pieces", "too_far"]

_PLACES = 65
"""On a piece: where it is looked how far it leads."""


def far_pieces(problem: TimingProblem, trajectory: PiecewisePolynomial) -> NDArray[np.bool_]:
    """Return a mask ``(p,)`` of a trajectory's pieces that are not near enough to its path."""
    far = np.zeros(trajectory.num_segments, dtype=np.bool_)
    if problem.deviation is not None and len(problem.path) > 1:
        path = np.ascontiguousarray(problem.path[:, problem.rows])
        control = np.ascontiguousarray(trajectory.control_points)
        find_far_pieces(control, path, problem.deviation + LIMIT_ROUNDING, far)
    return far


def too_far(problem: TimingProblem, trajectory: PiecewisePolynomial, piece: int) -> TimedPath:
    """Return that there is none, as a piece leads farther from the path than it may."""
    assert problem.deviation is not None
    times = np.linspace(trajectory.breaks[piece], trajectory.breaks[piece + 1], _PLACES)
    q, path = trajectory.value(times)[:, np.newaxis], problem.path[:, problem.rows]
    ways = np.diff(path, axis=0)
    lengths = np.maximum((ways**2).sum(axis=1), np.finfo(np.float64).tiny)
    parts = (((q - path[:-1]) * ways).sum(axis=2) / lengths).clip(0.0, 1.0)
    off = np.abs(q - path[:-1] - parts[:, :, np.newaxis] * ways)
    share = off / (problem.deviation + LIMIT_ROUNDING)
    # Of the nearest edge to each place, the farthest one.
    edges = np.argmin(share.max(axis=2), axis=1)
    places = np.arange(_PLACES)
    place = int(np.argmax(share[places, edges].max(axis=1)))
    row = int(np.argmax(share[place, edges[place]]))
    value, most = float(off[place, edges[place], row]), float(problem.deviation[row])
    return beyond_limit(problem, LimitExcess("deviation", row, value, most, float(times[place])))
