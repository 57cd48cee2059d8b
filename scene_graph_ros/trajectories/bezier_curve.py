"""Bézier curves in time: derivatives, parts, products and bounds without sampling."""

from __future__ import annotations

from dataclasses import dataclass

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
from scene_graph_ros.trajectories.bernstein import (
    differentiated,
    elevated,
    evaluated,
    multiplied,
    split,
)
from scene_graph_ros.trajectories.errors import TrajectoryError

__all__ = ["BezierCurve"]


@one_line()
@dataclass(frozen=True, eq=False)
class BezierCurve:
    """A polynomial curve in n dimensions from ``start_time`` to ``end_time``, s.

    ``control_points`` are rows ``(order + 1, n)``. The curve begins at the first, ends at the last
    and is in the hull of all (Farin, *Curves and Surfaces for CAGD*, 2002, chapters 4 to 6).

    Raises TrajectoryError for other shapes, for infinities, and unless the end is after
    the start.
    """

    start_time: float
    end_time: float
    control_points: NDArray[np.float64]

    def __post_init__(self) -> None:
        """Check and freeze the values."""
        for name in ("start_time", "end_time"):
            object.__setattr__(self, name, as_finite(name, getattr(self, name)))
        if not self.start_time < self.end_time:
            raise TrajectoryError(
                f"end_time must be after start_time: {self.end_time} is not after"
                f" {self.start_time}"
            )
        points = as_numbers("control_points", self.control_points)
        if points.ndim != 2 or not len(points):
            raise TrajectoryError(
                f"control_points must have shape (order + 1, n), not {points.shape}"
            )
        points.setflags(write=False)
        object.__setattr__(self, "control_points", points)

    # What it is.

    @property
    def duration(self) -> float:
        """How long it takes, s."""
        return self.end_time - self.start_time

    @property
    def rows(self) -> int:
        """The dimension n."""
        return int(self.control_points.shape[1])

    @property
    def order(self) -> int:
        """The degree of its polynomials: one less than the number of control points."""
        return len(self.control_points) - 1

    @property
    def initial_value(self) -> NDArray[np.float64]:
        """The first control point ``(n,)``: where it begins, without rounding."""
        return self.control_points[0]

    @property
    def final_value(self) -> NDArray[np.float64]:
        """The last control point ``(n,)``: where it ends, without rounding."""
        return self.control_points[-1]

    def value(self, t: ArrayLike) -> NDArray[np.float64]:
        """Return the values ``(m, n)`` at times ``(m,)``, or ``(n,)`` at one time.

        Before the start and after the end it is that at the start and at the end. Raises
        TrajectoryError for times that are no numbers.
        """
        times = as_times(t)
        flat = np.atleast_1d(times).clip(self.start_time, self.end_time)
        points = np.broadcast_to(self.control_points, (len(flat), *self.control_points.shape))
        result = evaluated(points, (flat - self.start_time) / self.duration)
        return result if times.ndim else result[0]

    def derivative(self, order: int = 1) -> BezierCurve:
        """Return its derivative of an order from 0 on, whose control points bound it."""
        times = as_order("order", order)
        points = differentiated(self.control_points[np.newaxis], times)[0]
        return self._with(points / self.duration**times)

    def bounds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return numbers ``(n,)`` that no value is below, and that none is above.

        They are those of the control points: proven, and nearer after `split`.
        """
        return self.control_points.min(axis=0), self.control_points.max(axis=0)

    def as_linear_in_control_points(self, derivative_order: int = 1) -> NDArray[np.float64]:
        """Return M ``(k, order + 1)``: ``M @ control_points`` are a derivative's ``(k, n)``.

        It depends on the order and the duration alone, so programs may have control points as
        variables.
        """
        unit = self._with(np.eye(self.order + 1))
        return unit.derivative(as_order("derivative_order", derivative_order)).control_points

    # Others made of it.

    def _with(self, points: NDArray[np.float64]) -> BezierCurve:
        return BezierCurve(self.start_time, self.end_time, points)

    def elevate_degree(self, degree: int) -> BezierCurve:
        """Return the same curve with the control points of a degree that is no lower.

        Raises TrajectoryError for a lower one.
        """
        wanted = as_order("degree", degree, self.order)
        return self._with(elevated(self.control_points[np.newaxis], wanted)[0])

    def split(self, t: float) -> tuple[BezierCurve, BezierCurve]:
        """Return the parts before and after a time inside. Raises TrajectoryError."""
        at = as_finite("t", t)
        if not self.start_time < at < self.end_time:
            raise TrajectoryError(
                f"t must be between {self.start_time} and {self.end_time}, not {at}"
            )
        part = (at - self.start_time) / self.duration
        left, right = split(self.control_points[np.newaxis], part)
        return BezierCurve(self.start_time, at, left[0]), BezierCurve(at, self.end_time, right[0])

    def reverse_time(self) -> BezierCurve:
        """Return the reversed curve r with ``r(start_time + end_time - t) = q(t)``."""
        return self._with(self.control_points[::-1])

    def scale_time(self, factor: float) -> BezierCurve:
        """Return the slower curve r with ``r(factor * t) = q(t)``; the factor is positive."""
        number = as_positive("factor", factor)
        return BezierCurve(number * self.start_time, number * self.end_time, self.control_points)

    def shift_right(self, offset: float) -> BezierCurve:
        """Return the curve later by ``offset``."""
        later = as_finite("offset", offset)
        return BezierCurve(self.start_time + later, self.end_time + later, self.control_points)

    def _other(self, other: BezierCurve, what: str) -> BezierCurve:
        """Return another curve over the same times, with which it can be combined."""
        if (other.start_time, other.end_time) != (self.start_time, self.end_time):
            raise TrajectoryError(
                f"curves are {what} over the same times: [{self.start_time}, {self.end_time}] is"
                f" not [{other.start_time}, {other.end_time}]"
            )
        if other.rows != self.rows and 1 not in (other.rows, self.rows):
            raise TrajectoryError(f"curves of {self.rows} and {other.rows} rows can't be {what}")
        return other

    def _sum(self, other: object, sign: float, what: str) -> BezierCurve:
        if not isinstance(other, BezierCurve):
            more = as_numbers(f"what is {what}", other)  # type: ignore[arg-type]
            if more.ndim > 1 or (more.ndim == 1 and len(more) != self.rows):
                raise TrajectoryError(
                    f"what is {what} must be a number or have shape ({self.rows},), not"
                    f" {more.shape}"
                )
            return self._with(self.control_points + sign * more)
        degree = max(self.order, self._other(other, what).order)
        first, second = (c.elevate_degree(degree).control_points for c in (self, other))
        return self._with(first + sign * second)

    def __add__(self, other: object) -> BezierCurve:
        return self._sum(other, 1.0, "added")

    def __sub__(self, other: object) -> BezierCurve:
        return self._sum(other, -1.0, "subtracted")

    def __neg__(self) -> BezierCurve:
        return self._with(-self.control_points)

    def __mul__(self, other: object) -> BezierCurve:
        """Return the product with a number, or with a curve over the same times, row by row.

        A curve of a single row multiplies each row. The order is the sum of both.
        """
        if isinstance(other, BezierCurve):
            points = (self.control_points, self._other(other, "multiplied").control_points)
            return self._with(multiplied(*(p[np.newaxis] for p in points))[0])
        number = as_float(other)
        if number is None or not abs(number) < np.inf:
            raise TrajectoryError(f"a factor must be a curve or a number, not {quoted(other)}")
        return self._with(number * self.control_points)

    __rmul__ = __mul__
