"""A motion along a path by its speeds at some places."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.trajectories.errors import TrajectoryError
from scene_graph_ros.trajectories.path_parameterized_trajectory import (
    PathParameterizedTrajectory,
)
from scene_graph_ros.trajectories.piecewise_polynomial import PiecewisePolynomial

__all__ = ["motion_of_speeds"]


def motion_of_speeds(
    path: PiecewisePolynomial, s: NDArray[np.float64], speeds: NDArray[np.float64]
) -> PathParameterizedTrajectory:
    """Return the motion along q(s) from 0 s on that has some speeds ds/dt at places ``(k,)``.

    Between two places it speeds up or slows down evenly. Raises TrajectoryError where both are at
    rest.
    """
    with np.errstate(divide="ignore"):
        seconds = 2.0 * np.diff(s) / (speeds[:-1] + speeds[1:])
    if not np.isfinite(seconds).all():
        where = float(s[int(np.argmax(~np.isfinite(seconds)))])
        raise TrajectoryError(f"the path can't be left at {where}: it stands still there")
    times = np.concatenate([[0.0], seconds.cumsum()])
    middle = (s[:-1] + 0.5 * speeds[:-1] * seconds).clip(s[:-1], s[1:])
    scaling = np.stack([s[:-1], middle, s[1:]], axis=1)[:, :, np.newaxis]
    # What takes less than the times' rounding is no time.
    takes_time = np.diff(times) > 0.0
    breaks = np.concatenate([times[:1], times[1:][takes_time]])
    return PathParameterizedTrajectory(path, PiecewisePolynomial(breaks, scaling[takes_time]))
