"""Ruckig in place of our own search for the fastest motion along a path."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.trajectories.errors import RetimingError, TrajectoryError
from scene_graph_ros.trajectories.motion_limits import MotionLimits
from scene_graph_ros.trajectories.path_parameterized_trajectory import (
    PathParameterizedTrajectory,
)
from scene_graph_ros.trajectories.piecewise_polynomial import PiecewisePolynomial
from scene_graph_ros.trajectories.retimer import Retimer
from scene_graph_ros.trajectories.retimers.retimer_libraries import get_ruckig
from scene_graph_ros.trajectories.smooth_pieces import smooth_pieces
from scene_graph_ros.trajectories.time_optimal import straight_segments

__all__ = ["RuckigRetimer"]


@one_line()
@dataclass(frozen=True)
class RuckigRetimer(Retimer):
    """Ruckig as a retimer of `time_path` (Berscheid and Kröger, 2021).

    Its free edition goes from state to state, so it rests at each corner of the path: points on
    the way would take its makers' service in the network, which is not asked. Along each straight
    way it moves one number, the path's parameter, within the least of all limits divided by how
    fast positions change with it: of motions that stay on that way this is the fastest one.
    Without limits of jerk accelerations jump.
    """

    stops_at_corners = True
    keeps_jerks = True

    def motion(
        self, path: PiecewisePolynomial, limits: MotionLimits
    ) -> PathParameterizedTrajectory:
        """Return Ruckig's motions along all straight ways in turn.

        Raises TrajectoryError for a path that is not straight between corners, RetimingError where
        Ruckig finds none, MissingRetimerError.
        """
        time, breaks, points = 0.0, [np.zeros(1)], []
        for piece in smooth_pieces(path):
            if not straight_segments(piece).all():
                raise TrajectoryError(
                    "the retimer 'ruckig' goes along straight ways, and the path is curved from"
                    f" {piece.start_time:g} to {piece.end_time:g}: take 'toppra', or our own"
                )
            seconds, scaling = _along(piece, limits)
            breaks.append(time + seconds[1:])
            points.append(scaling)
            time += float(seconds[-1])
        return PathParameterizedTrajectory(
            path, PiecewisePolynomial(np.concatenate(breaks), np.concatenate(points))
        )


_INSTANT = 1e-9
"""Of a motion's duration."""


def _along(
    piece: PiecewisePolynomial, limits: MotionLimits
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return times ``(p + 1,)`` from 0 on, and the control points ``(p, 4, 1)`` of s between.

    Ruckig's tolerances are absolute, so the way is 1 long, and takes some units of time.
    """
    way = np.abs(piece.control_points[-1, -1] - piece.control_points[0, 0])
    given = (limits.velocities, limits.accelerations, limits.jerks)
    with np.errstate(divide="ignore"):
        most = [np.inf if each is None else float((each / way).min()) for each in given]
    unit = max(most[0] ** -1, most[1] ** -0.5, most[2] ** (-1.0 / 3.0))
    ruckig = get_ruckig()
    asked = ruckig.InputParameter(1)
    asked.current_position, asked.target_position = [0.0], [1.0]
    asked.max_velocity, asked.max_acceleration, asked.max_jerk = (
        [number * unit**order] for order, number in enumerate(most, 1)
    )
    found = ruckig.Trajectory(1)
    try:
        result = ruckig.Ruckig(1).calculate(asked, found)
    except ruckig.RuckigError as error:
        why = str(error).strip().partition("\n")[0]
        raise RetimingError(f"Ruckig found no motion along the path: {why}") from error
    if result not in (ruckig.Result.Working, ruckig.Result.Finished):
        raise RetimingError(f"Ruckig found no motion along the path: {result.name}")
    profile = found.profiles[0][0]
    steps = np.array(profile.t)
    # Phases of an instant are what rounding leaves; their jerk would be any.
    takes_time = steps > _INSTANT * steps.sum()
    if not np.isfinite(steps).all() or not takes_time.any():
        raise RetimingError("Ruckig's motion along the path has no phases")
    s, speeds = (np.array(each) / profile.p[-1] for each in (profile.p, profile.v))
    third = steps / 3.0
    scaling = np.stack(
        [s[:-1], s[:-1] + third * speeds[:-1], s[1:] - third * speeds[1:], s[1:]], axis=1
    )[takes_time].clip(0.0, 1.0)
    seconds = np.concatenate([[0.0], (unit * steps[takes_time]).cumsum()])
    return seconds, (piece.start_time + piece.duration * scaling)[:, :, np.newaxis]
