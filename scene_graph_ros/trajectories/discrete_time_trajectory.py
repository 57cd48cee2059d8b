"""Values at some times, and at no other ones."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.trajectories.arguments import (
    as_finite,
    as_numbers,
    as_order,
    as_positive,
    as_times,
)
from scene_graph_ros.trajectories.errors import TrajectoryError
from scene_graph_ros.trajectories.piecewise_polynomial import PiecewisePolynomial

__all__ = ["DiscreteTimeTrajectory"]


@one_line()
@dataclass(frozen=True, eq=False)
class DiscreteTimeTrajectory:
    """``values`` ``(m, n)`` at ``times`` ``(m,)`` that grow, and nothing between them.

    A time is one of these where it is no farther than ``time_comparison_tolerance`` (s) from it.
    Raises TrajectoryError for other shapes, infinities, and times nearer to each other
    than twice the tolerance.
    """

    times: NDArray[np.float64]
    values: NDArray[np.float64]
    time_comparison_tolerance: float = float(np.finfo(np.float64).eps)

    def __post_init__(self) -> None:
        """Check and freeze the arrays."""
        times, values = as_numbers("times", self.times), as_numbers("values", self.values)
        if times.ndim != 1 or not len(times):
            raise TrajectoryError(f"times must be one number or more, not {times.shape}")
        if values.ndim != 2 or len(values) != len(times):
            raise TrajectoryError(f"values must have shape ({len(times)}, n), not {values.shape}")
        tolerance = as_finite("time_comparison_tolerance", self.time_comparison_tolerance)
        if tolerance < 0.0:
            raise TrajectoryError(f"time_comparison_tolerance must be from 0 on, not {tolerance}")
        if not (np.diff(times) > 2.0 * tolerance).all():
            k = int(np.argmin(np.diff(times)))
            raise TrajectoryError(
                f"times must grow, by more than twice the tolerance {tolerance:g}: {times[k]} is"
                f" before {times[k + 1]}"
            )
        for name, array in (("times", times), ("values", values)):
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    @property
    def start_time(self) -> float:
        """The first time, s."""
        return float(self.times[0])

    @property
    def end_time(self) -> float:
        """The last time, s."""
        return float(self.times[-1])

    @property
    def duration(self) -> float:
        """From the first time to the last."""
        return self.end_time - self.start_time

    @property
    def rows(self) -> int:
        """The dimension n."""
        return int(self.values.shape[1])

    @property
    def num_times(self) -> int:
        """How many times there are."""
        return len(self.times)

    def value(self, t: ArrayLike) -> NDArray[np.float64]:
        """Return the values ``(m, n)`` at times ``(m,)``, or ``(n,)`` at one time.

        Raises TrajectoryError for a time that is none of its own.
        """
        asked = as_times(t)
        flat = np.atleast_1d(asked)
        after = np.searchsorted(self.times, flat).clip(0, self.num_times - 1)
        before = (after - 1).clip(0)
        is_before = np.abs(flat - self.times[before]) <= np.abs(flat - self.times[after])
        nearest = np.where(is_before, before, after)
        is_far = np.abs(flat - self.times[nearest]) > self.time_comparison_tolerance
        if is_far.any():
            k = int(np.argmax(is_far))
            raise TrajectoryError(
                f"t = {flat[k]} is no time of this curve; the nearest is"
                f" {self.times[nearest[k]]}: take to_zero_order_hold() for what is between"
            )
        return self.values[nearest] if asked.ndim else self.values[nearest[0]]

    def to_zero_order_hold(self) -> PiecewisePolynomial:
        """Return steps that keep each value until the next time, but for the last."""
        return PiecewisePolynomial.zero_order_hold(self.times, self.values)

    def derivative(self, order: int = 1) -> DiscreteTimeTrajectory:
        """Return itself for the order 0. Raises TrajectoryError for others: there are none."""
        if as_order("order", order):
            raise TrajectoryError(f"order must be 0: a discrete curve has no derivative {order}")
        return self

    def reverse_time(self) -> DiscreteTimeTrajectory:
        """Return the reversed values: those at ``start_time + end_time - t`` are these at t."""
        times = (self.start_time + self.end_time) - self.times[::-1]
        return self._at(times, self.values[::-1])

    def scale_time(self, factor: float) -> DiscreteTimeTrajectory:
        """Return the values at ``factor * t``. The factor is positive."""
        return self._at(as_positive("factor", factor) * self.times, self.values)

    def shift_right(self, offset: float) -> DiscreteTimeTrajectory:
        """Return the values later by ``offset``."""
        return self._at(self.times + as_finite("offset", offset), self.values)

    def _at(
        self, times: NDArray[np.float64], values: NDArray[np.float64]
    ) -> DiscreteTimeTrajectory:
        return DiscreteTimeTrajectory(times, values, self.time_comparison_tolerance)
