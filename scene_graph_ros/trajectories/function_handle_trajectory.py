"""A curve that a function of one's own has the values of."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.reals import as_float
from scene_graph_ros.trajectories.arguments import (
    as_finite,
    as_numbers,
    as_order,
    as_positive,
    as_times,
)
from scene_graph_ros.trajectories.errors import TrajectoryError

__all__ = ["FunctionHandleTrajectory"]


@one_line("rows", "start_time", "end_time")
@dataclass(frozen=True, eq=False)
class FunctionHandleTrajectory:
    """A curve whose value at t (s) is ``func(t)`` ``(rows,)``, from one time to another.

    ``func_derivative(t, order)`` returns derivatives ``(rows,)`` from the first on; without it
    there are none. Both times may be infinite. Raises TrajectoryError for other arguments, and,
    when it is asked, for a function's answer of another shape or not finite.
    """

    func: Callable[[float], ArrayLike]
    rows: int
    start_time: float = -np.inf
    end_time: float = np.inf
    func_derivative: Callable[[float, int], ArrayLike] | None = None

    def __post_init__(self) -> None:
        """Check all that needs no call of a function."""
        if not callable(self.func):
            raise TrajectoryError(f"func must be a function of a time, not {quoted(self.func)}")
        if self.func_derivative is not None and not callable(self.func_derivative):
            raise TrajectoryError(
                "func_derivative must be a function of a time and an order, not"
                f" {quoted(self.func_derivative)}"
            )
        object.__setattr__(self, "rows", as_order("rows", self.rows))
        given: Any = (self.start_time, self.end_time)
        start, end = (as_float(each) for each in given)
        is_order = start is not None and end is not None and start <= end
        if start is None or end is None or not is_order or start == np.inf or end == -np.inf:
            raise TrajectoryError(
                f"start_time and end_time must be numbers in this order, not {quoted(given[0])}"
                f" and {quoted(given[1])}"
            )
        object.__setattr__(self, "start_time", start)
        object.__setattr__(self, "end_time", end)

    @property
    def duration(self) -> float:
        """From the start to the end, s."""
        return self.end_time - self.start_time

    def value(self, t: ArrayLike) -> NDArray[np.float64]:
        """Return the values ``(m, n)`` at times ``(m,)``, or ``(n,)`` at one time.

        The function is asked about one time after another; before the start and after the end it
        is that at the start and at the end.
        """
        times = as_times(t)
        flat = np.atleast_1d(times).clip(self.start_time, self.end_time)
        result = np.empty((len(flat), self.rows))
        for k, each in enumerate(flat.tolist()):
            found = as_numbers(f"func({each:g})", self.func(each))
            if found.shape != (self.rows,):
                raise TrajectoryError(
                    f"func({each:g}) must have shape ({self.rows},), not {found.shape}"
                )
            result[k] = found
        return result if times.ndim else result[0]

    def derivative(self, order: int = 1) -> FunctionHandleTrajectory:
        """Return its derivative of an order from 0 on. Raises TrajectoryError without any."""
        count, known = as_order("order", order), self.func_derivative
        if not count:
            return self
        if known is None:
            raise TrajectoryError(
                f"order must be 0, not {count}: give func_derivative for derivatives"
            )
        return FunctionHandleTrajectory(
            lambda t: known(t, count),
            self.rows,
            self.start_time,
            self.end_time,
            lambda t, more: known(t, count + more),
        )

    def reverse_time(self) -> FunctionHandleTrajectory:
        """Return the reversed curve r with ``r(start_time + end_time - t) = q(t)``.

        Raises TrajectoryError where a time is infinite.
        """
        if not np.isfinite(self.duration):
            raise TrajectoryError("a curve without a start or an end can't be reversed")
        whole = self.start_time + self.end_time
        return self._of_time(lambda t: whole - t, -1.0, self.start_time, self.end_time)

    def scale_time(self, factor: float) -> FunctionHandleTrajectory:
        """Return the slower curve r with ``r(factor * t) = q(t)``; the factor is positive."""
        times = as_positive("factor", factor)
        ends = times * self.start_time, times * self.end_time
        return self._of_time(lambda t: t / times, 1.0 / times, *ends)

    def shift_right(self, offset: float) -> FunctionHandleTrajectory:
        """Return the curve later by ``offset``."""
        later = as_finite("offset", offset)
        ends = self.start_time + later, self.end_time + later
        return self._of_time(lambda t: t - later, 1.0, *ends)

    def _of_time(
        self, inner: Callable[[float], float], rate: float, start: float, end: float
    ) -> FunctionHandleTrajectory:
        """Return the curve at a time that grows evenly."""
        func, known = self.func, self.func_derivative
        derivative = None
        if known is not None:
            some = known

            def derivative(t: float, order: int) -> ArrayLike:
                return rate**order * as_numbers("func_derivative", some(inner(t), order))

        return FunctionHandleTrajectory(
            lambda t: func(inner(t)), self.rows, start, end, derivative
        )
