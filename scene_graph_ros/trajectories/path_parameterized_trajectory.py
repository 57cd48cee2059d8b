"""A path that is followed in time: q(s(t))."""

from __future__ import annotations

from dataclasses import dataclass, replace
import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.trajectories.arguments import as_order
from scene_graph_ros.trajectories.errors import TrajectoryError
from scene_graph_ros.trajectories.piecewise_polynomial import PiecewisePolynomial

__all__ = ["PathParameterizedTrajectory"]

_BEYOND = 1e-9
"""Of a path's length: what rounding may add to where its times lead."""


@one_line()
@dataclass(frozen=True, eq=False)
class PathParameterizedTrajectory:
    """The trajectory ``path.value(time_scaling.value(t))``.

    ``path`` is a curve q(s) in n dimensions, ``time_scaling`` one of a single row, s(t). An answer
    of `derivative` has an ``order`` above 0: it is ``factor`` times the derivative of that order
    by time. Raises TrajectoryError where ``time_scaling`` has more rows, or leaves the path.
    """

    path: PiecewisePolynomial
    time_scaling: PiecewisePolynomial
    order: int = 0
    factor: float = 1.0

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
        """Return the derivatives of an order from 0 on by time, by the chain rule.

        Taylor's polynomial of s(t) is put into that of q(s). Raises TrajectoryError.
        """
        count = self.order + as_order("order", order)
        s = self.time_scaling.value(t)[..., 0]
        if count == 0:
            return self.factor * self.path.value(s)
        ahead = [
            self.time_scaling.derivative(k).value(t) / math.factorial(k)
            for k in range(1, count + 1)
        ]
        # Coefficients of h^0, h^1, ... in (s(t + h) - s(t))^j.
        power = [np.ones_like(ahead[0]), *(np.zeros_like(ahead[0]) for _ in ahead)]
        result = np.zeros((*s.shape, self.rows))
        for j in range(1, count + 1):
            power = [
                sum((power[k - i] * ahead[i - 1] for i in range(1, k + 1)), 0.0 * power[0])
                for k in range(count + 1)
            ]
            result += self.path.derivative(j).value(s) / math.factorial(j) * power[count]
        return self.factor * math.factorial(count) * result

    def derivative(self, order: int = 1) -> PathParameterizedTrajectory:
        """Return its derivative of an order from 0 on."""
        return replace(self, order=self.order + as_order("order", order))

    # Others made of it.

    def reverse_time(self) -> PathParameterizedTrajectory:
        """Return the reversed curve r with ``r(start_time + end_time - t) = q(t)``."""
        reverse = self.time_scaling.reverse_time()
        return replace(self, time_scaling=reverse, factor=(-1.0) ** self.order * self.factor)

    def scale_time(self, factor: float) -> PathParameterizedTrajectory:
        """Return the slower curve r with ``r(factor * t) = q(t)``; the factor is positive."""
        slower = self.time_scaling.scale_time(factor)
        return replace(self, time_scaling=slower, factor=float(factor) ** self.order * self.factor)

    def shift_right(self, offset: float) -> PathParameterizedTrajectory:
        """Return it later by ``offset``."""
        return replace(self, time_scaling=self.time_scaling.shift_right(offset))
