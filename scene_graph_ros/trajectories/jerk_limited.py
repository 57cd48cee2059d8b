"""Points of a trajectory along a path within limits of jerk, too."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.trajectories.derivatives_of import LEAST_DEGREE
from scene_graph_ros.trajectories.guessed_motion import PathStates
from scene_graph_ros.trajectories.jerk_limited_motion import fastest_states
from scene_graph_ros.trajectories.motion_ends import AT_REST, MotionEnds
from scene_graph_ros.trajectories.motion_limits import MotionLimits
from scene_graph_ros.trajectories.path_parameterized_trajectory import (
    PathParameterizedTrajectory,
)
from scene_graph_ros.trajectories.piecewise_polynomial import PiecewisePolynomial
from scene_graph_ros.trajectories.sampling import LONGEST, Sampled, slowed, States, too_long
from scene_graph_ros.trajectories.smooth_pieces import smooth_pieces
from scene_graph_ros.trajectories.state_kernels import write_states

__all__ = ["sample_jerk_limited"]

Array = NDArray[np.float64]


def sample_jerk_limited(
    path: PiecewisePolynomial,
    limits: MotionLimits,
    ends: MotionEnds = AT_REST,
    *,
    judged_by: MotionLimits | None = None,
    fineness: float = 1.0,
) -> Sampled:
    """Return points of the fastest motion along a path within all limits, of jerk, too.

    It rests where the path's direction jumps, and at both ends, unless ``ends`` say how it moves
    there. Limits that it is ``judged_by`` may be wider than those that it is made for. It
    has ``fineness`` times as many points as by default. Raises TooLongError for a motion that
    takes too long for a message.
    """
    pieces = smooth_pieces(path)
    rates = [(0.0, 0.0)] * (len(pieces) + 1)
    rates[0], rates[-1] = ends.start, ends.end
    found = [
        fastest_states(piece, limits, *own, fineness)
        for piece, own in zip(pieces, pairwise(rates), strict=True)
    ]
    states, rests = _joined([each for each, _ in found])
    if not states.times[-1] <= LONGEST:
        raise too_long(path, limits)
    curve = path if path.degree >= LEAST_DEGREE else path.elevate_degree(LEAST_DEGREE)

    def states_at(nanoseconds: NDArray[np.int64], factor: float) -> States:
        return _states(curve, states, rests, nanoseconds, factor, ends)

    def motion() -> PathParameterizedTrajectory:
        return _motion(path, states)

    judged = judged_by or limits
    if not ends.is_rest:
        # What is slowed down has other velocities at its ends.
        return slowed(states.times, states_at, judged, motion, rounds=1)
    factor = max(each for _, each in found)
    return slowed(states.times, states_at, judged, motion, factor)


def _joined(parts: list[PathStates]) -> tuple[PathStates, NDArray[np.intp]]:
    """Return the states of motions one after another, and at which nodes they rest."""
    offsets = np.cumsum([0.0, *(part.times[-1] for part in parts)])
    times = [offset + part.times[1:] for offset, part in zip(offsets[:-1], parts, strict=True)]
    rows = [
        np.concatenate([parts[0][i][:1], *(part[i][1:] for part in parts)]) for i in range(1, 4)
    ]
    rests = np.cumsum([0, *(len(part.s) - 1 for part in parts)])
    return PathStates(np.concatenate([[0.0], *times]), *rows), rests


def _motion(path: PiecewisePolynomial, states: PathStates) -> PathParameterizedTrajectory:
    """Return its parameters on the path at all times."""
    scaling = states.scaling()
    # Between two nodes s may swing beyond an end by rounding of their times.
    within = scaling.control_points.clip(path.start_time, path.end_time)
    return PathParameterizedTrajectory(path, PiecewisePolynomial(scaling.breaks, within))


def _states(
    path: PiecewisePolynomial,
    states: PathStates,
    rests: NDArray[np.intp],
    nanoseconds: NDArray[np.int64],
    factor: float,
    ends: MotionEnds,
) -> States:
    """Return a motion's states at the whole nanoseconds next to its nodes, so much slower."""
    q, v, a = np.empty((3, len(nanoseconds), path.rows))
    late = nanoseconds * (1e-9 / factor) - states.times
    late[rests] = 0.0
    write_states(path.breaks, path.control_points, states, late, factor, q, v, a)
    q[[0, -1]] = path.control_points[0, 0], path.control_points[-1, -1]
    if ends.rates is not None:
        v[[0, -1]], a[[0, -1]] = zip(*ends.rates, strict=True)
    return q, v, a
