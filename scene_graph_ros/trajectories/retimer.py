"""Methods that find the speed along a path: ours, or another one in its place."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.reals import as_float
from scene_graph_ros.trajectories.errors import TrajectoryError
from scene_graph_ros.trajectories.motion_ends import MotionEnds
from scene_graph_ros.trajectories.motion_limits import MotionLimits
from scene_graph_ros.trajectories.path_parameterized_trajectory import (
    PathParameterizedTrajectory,
)
from scene_graph_ros.trajectories.piecewise_polynomial import PiecewisePolynomial
from scene_graph_ros.trajectories.time_optimal import GRID_POINTS, retime

__all__ = ["Retimer", "TimeOptimalRetimer", "as_grid_points"]


@one_line()
class Retimer(ABC):
    """Finds a motion along a path within limits; the caller checks its answer."""

    stops_at_corners: bool = False
    """Whether it rests at each corner, so that none need be rounded."""

    keeps_jerks: bool = False
    """Whether its motions are within limits of jerk, without a mean over a rise time."""

    @abstractmethod
    def motion(
        self, path: PiecewisePolynomial, limits: MotionLimits
    ) -> PathParameterizedTrajectory:
        """Return q(s(t)) from rest to rest, starting at 0 s, at rest where the direction jumps.

        Raises RetimingError where it finds none, TrajectoryError for a path it can't go along.
        """

    def curve(
        self, configurations: NDArray[np.float64], units: NDArray[np.float64]
    ) -> PiecewisePolynomial | None:
        """Return its own curve through the points ``(n, k)`` of a path of straight edges, or None.

        Lengths are measured as in `CornerPath`. None: it goes along the path, its corners rounded.
        """
        return None

    def finer(self) -> Retimer:
        """Return it with twice as many stretches of a path, where it has some."""
        return self


@dataclass(frozen=True)
class TimeOptimalRetimer(Retimer):
    """Ours: see `retime`."""

    grid_points: int = GRID_POINTS

    def __post_init__(self) -> None:
        """Check the number."""
        object.__setattr__(self, "grid_points", as_grid_points(self.grid_points))

    def motion(
        self, path: PiecewisePolynomial, limits: MotionLimits
    ) -> PathParameterizedTrajectory:
        """Return the fastest motion."""
        return retime(path, limits, grid_points=self.grid_points)

    def motion_between(
        self, path: PiecewisePolynomial, limits: MotionLimits, ends: MotionEnds
    ) -> PathParameterizedTrajectory:
        """Return the fastest motion with some speeds at both ends. Raises RetimingError."""
        return retime(
            path,
            limits,
            grid_points=self.grid_points,
            start_speed=ends.start[0],
            end_speed=ends.end[0],
        )

    @property
    def fineness(self) -> float:
        """How many times as many nodes a jerk-limited motion gets as by default."""
        return self.grid_points / GRID_POINTS

    def finer(self) -> TimeOptimalRetimer:
        """Return it with twice as many stretches."""
        return replace(self, grid_points=2 * self.grid_points)


def as_grid_points(value: object) -> int:
    """Return a number of stretches. Raises TrajectoryError."""
    number = as_float(value)
    if number is None or number < 1.0 or not number.is_integer():
        raise TrajectoryError(f"grid_points must be a whole number from 1 on, not {quoted(value)}")
    return int(number)
