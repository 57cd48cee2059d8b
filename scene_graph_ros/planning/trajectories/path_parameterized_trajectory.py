"""A path that is followed in time: q(s(t))."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.planning.trajectories.errors import TrajectoryError
from scene_graph_ros.planning.trajectories.piecewise_polynomial import PiecewisePolynomial

__all__ = ["PathParameterizedTrajectory"]

_BEYOND = 1e-9
"""Of a path's length: what rounding may add to where its times lead."""


@dataclass(frozen=True, eq=False)
class PathParameterizedTrajectory:
    """The trajectory ``path.value(time_scaling.value(t))``.

    ``path`` is a curve q(s) in n dimensions, ``time_scaling`` one of a single row, s(t). Raises
    TrajectoryError where that has more rows, or leaves the path.
    """

    path: PiecewisePolynomial
    time_scaling: PiecewisePolynomial

    def __post_init__(self) -> None:
        """Check that they fit."""
        if self.time_scaling.rows != 1:
            raise TrajectoryError(f"time_scaling has {self.time_scaling.rows} rows, not one")
        reached = self.time_scaling.control_points
        path, slack = self.path, _BEYOND * self.path.duration
        if reached.min() < path.start_time - slack or reached.max() > path.end_time + slack:
            raise TrajectoryError(
                f"time_scaling leads from {reached.min()} to {reached.max()}, the path from"
                f" {path.start_time} to {path.end_time}"
            )

    @property
    def start_time(self) -> float:
        """When it begins, s."""
        return self.time_scaling.start_time

    @property
    def end_time(self) -> float:
        """When it ends, s."""
        return self.time_scaling.end_time

    @property
    def duration(self) -> float:
        """How long it takes, s."""
        return self.time_scaling.duration

    @property
    def rows(self) -> int:
        """The dimension n."""
        return self.path.rows

    def value(self, t: ArrayLike) -> NDArray[np.float64]:
        """Return the values ``(m, n)`` at times ``(m,)``, or ``(n,)`` at one time."""
        return self.eval_derivative(t, 0)

    def eval_derivative(self, t: ArrayLike, order: int = 1) -> NDArray[np.float64]:
        """Return the derivatives of an order from 0 to 2 by time, by the chain rule."""
        s = self.time_scaling.value(t)[..., 0]
        if order == 0:
            return self.path.value(s)
        rate, along = self.time_scaling.derivative().value(t), self.path.derivative()
        if order == 1:
            return along.value(s) * rate
        if order == 2:
            speedup = self.time_scaling.derivative(2).value(t)
            return along.derivative().value(s) * rate**2 + along.value(s) * speedup
        raise TrajectoryError(f"order must be 0, 1 or 2, not {order!r}")
