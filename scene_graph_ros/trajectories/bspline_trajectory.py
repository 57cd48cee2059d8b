"""Curves that are polynomials between knots and smooth at them, by few control points."""

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

__all__ = ["BsplineTrajectory"]


@one_line()
@dataclass(frozen=True, eq=False)
class BsplineTrajectory:
    """A B-spline curve in n dimensions.

    ``control_points`` are rows ``(c, n)``, ``knots`` ``(c + degree + 1,)`` never fall. It begins
    at ``knots[degree]``, ends at ``knots[c]``, and is in the hull of its control points. At a knot
    that comes k times ``degree - k`` derivatives go on; where one comes ``degree + 1`` times the
    curve jumps, more often none comes (Farin, *Curves and Surfaces for CAGD*, 2002, chapter 8).

    Raises TrajectoryError for other shapes, for infinities, and for other knots.
    """

    knots: NDArray[np.float64]
    control_points: NDArray[np.float64]

    def __post_init__(self) -> None:
        """Check and freeze the arrays."""
        knots = as_numbers("knots", self.knots)
        points = as_numbers("control_points", self.control_points)
        if points.ndim != 2 or not len(points):
            raise TrajectoryError(f"control_points must have shape (c, n), not {points.shape}")
        if knots.ndim != 1 or not len(points) < len(knots) <= 2 * len(points):
            raise TrajectoryError(
                f"knots must be {len(points) + 1} to {2 * len(points)}, as many as control points"
                f" and one more than the degree, not {knots.shape}"
            )
        if (np.diff(knots) < 0.0).any():
            i = int(np.argmax(np.diff(knots) < 0.0))
            raise TrajectoryError(f"knots must not fall: {knots[i]} is before {knots[i + 1]}")
        degree, count = len(knots) - len(points) - 1, len(points)
        if not knots[degree] < knots[count]:
            raise TrajectoryError(
                f"the curve must end after its start: knots[{count}] = {knots[count]} is not after"
                f" knots[{degree}] = {knots[degree]}"
            )
        widths = knots[degree + 1 :] - knots[: -degree - 1]
        if not (widths > 0.0).all():
            at = knots[int(np.argmin(widths))]
            raise TrajectoryError(
                f"knots must come at most degree + 1 = {degree + 1} times, {at} comes more often"
            )
        for name, array in (("knots", knots), ("control_points", points)):
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    @classmethod
    def clamped_uniform(
        cls, control_points: ArrayLike, degree: int, start_time: float = 0.0, end_time: float = 1.0
    ) -> BsplineTrajectory:
        """Return the curve from the first control point to the last, with even knots between.

        ``control_points`` are ``(c, n)``; times are in s.
        """
        points = as_numbers("control_points", control_points)
        d = as_order("degree", degree)
        start, end = as_finite("start_time", start_time), as_finite("end_time", end_time)
        inner = np.linspace(start, end, max(len(np.atleast_1d(points)) - d + 1, 2))
        return cls(np.concatenate([[start] * d, inner, [end] * d]), points)

    # What it is.

    @property
    def degree(self) -> int:
        """The degree of its polynomials."""
        return len(self.knots) - len(self.control_points) - 1

    @property
    def start_time(self) -> float:
        """When it begins, s."""
        return float(self.knots[self.degree])

    @property
    def end_time(self) -> float:
        """When it ends, s."""
        return float(self.knots[len(self.control_points)])

    @property
    def duration(self) -> float:
        """How long it takes, s."""
        return self.end_time - self.start_time

    @property
    def rows(self) -> int:
        """The dimension n."""
        return int(self.control_points.shape[1])

    def value(self, t: ArrayLike) -> NDArray[np.float64]:
        """Return the values ``(m, n)`` at times ``(m,)``, or ``(n,)`` at one time.

        Before the start and after the end it is that at the start and at the end. Raises
        TrajectoryError for times that are no numbers.
        """
        times = as_times(t)
        flat = np.atleast_1d(times).clip(self.start_time, self.end_time)
        # The span that begins at a knot; at the end the last one that isn't empty.
        spans = np.searchsorted(self.knots, flat, side="right") - 1
        last = int(np.searchsorted(self.knots, self.end_time, side="left")) - 1
        result = self._blossom(np.minimum(spans, last), np.repeat(flat[:, None], self.degree, 1))
        return result if times.ndim else result[0]

    def _blossom(
        self, spans: NDArray[np.int64], places: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the polar forms ``(m, n)`` of spans ``(m,)`` at places ``(m, degree)``.

        At one place, repeated, that is the value (de Boor's algorithm).
        """
        d = self.degree
        points = self.control_points[spans[:, None] - d + np.arange(d + 1)]
        for level in range(1, d + 1):
            lower = self.knots[spans[:, None] - d + np.arange(level, d + 1)]
            upper = self.knots[spans[:, None] + 1 + np.arange(d + 1 - level)]
            part = ((places[:, level - 1, None] - lower) / (upper - lower))[..., None]
            points = (1.0 - part) * points[:, :-1] + part * points[:, 1:]
        result: NDArray[np.float64] = points[:, 0]
        return result

    @property
    def centers(self) -> NDArray[np.float64]:
        """When each control point counts most ``(m,)``, s: the middle of its knots (Greville)."""
        d, count = self.degree, len(self.control_points)
        if d == 0:
            return 0.5 * (self.knots[:-1] + self.knots[1:])
        return np.array([self.knots[k + 1 : k + 1 + d].mean() for k in range(count)])

    def derivative(self, order: int = 1) -> BsplineTrajectory:
        """Return its derivative of an order from 0 on, whose control points bound it."""
        result = self
        for _ in range(as_order("order", order)):
            d, points, knots = result.degree, result.control_points, result.knots
            if d == 0:
                return BsplineTrajectory(knots, np.zeros_like(points))
            widths = knots[d + 1 : -1] - knots[1 : -d - 1]
            # Where the curve jumps nothing is between two of its control points.
            some = np.flatnonzero(widths > 0.0)
            rates = d * np.diff(points, axis=0)[some] / widths[some, None]
            kept = np.delete(knots[1:-1], np.flatnonzero(widths == 0.0))
            result = BsplineTrajectory(kept, rates)
        return result

    def bounds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return numbers ``(n,)`` that no value is below, and that none is above: proven."""
        return self.control_points.min(axis=0), self.control_points.max(axis=0)

    def as_linear_in_control_points(self, derivative_order: int = 1) -> NDArray[np.float64]:
        """Return M ``(k, c)``: ``M @ control_points`` ``(k, n)`` are those of a derivative.

        It depends on knots alone, so programs may have control points as variables.
        """
        unit = BsplineTrajectory(self.knots, np.eye(len(self.control_points)))
        return unit.derivative(as_order("derivative_order", derivative_order)).control_points

    def evaluate_linear_in_control_points(
        self, t: ArrayLike, derivative_order: int = 0
    ) -> NDArray[np.float64]:
        """Return weights ``(c,)``, or ``(m, c)`` at times ``(m,)``, of a derivative's values.

        ``weights @ control_points`` is what ``derivative(derivative_order).value(t)`` returns.
        """
        unit = BsplineTrajectory(self.knots, np.eye(len(self.control_points)))
        return unit.derivative(as_order("derivative_order", derivative_order)).value(t)

    # Others made of it.

    def insert_knots(self, additional_knots: ArrayLike) -> BsplineTrajectory:
        """Return the same curve with more knots, and with a further control point for each.

        From the start to the end; each may come ``degree + 1`` times in all. The control points
        come nearer to the curve (Boehm, "Inserting new knots into B-spline curves", 1980). Raises
        TrajectoryError for other knots.
        """
        more = np.atleast_1d(as_numbers("additional_knots", additional_knots))
        if more.ndim != 1:
            raise TrajectoryError(f"additional_knots must have shape (k,), not {more.shape}")
        d, knots, points = self.degree, self.knots, self.control_points
        for knot in more:
            if not self.start_time <= knot <= self.end_time:
                raise TrajectoryError(
                    f"additional_knots must be from {self.start_time} to {self.end_time}, not"
                    f" {knot}"
                )
            if np.count_nonzero(knots == knot) > d:
                raise TrajectoryError(
                    f"knots must come at most degree + 1 = {d + 1} times, {knot} comes more often"
                )
            last = int(np.searchsorted(knots, self.end_time, side="left")) - 1
            k = min(int(np.searchsorted(knots, knot, side="right")) - 1, last)
            i = np.arange(k - d + 1, k + 1)
            part = ((knot - knots[i]) / (knots[i + d] - knots[i]))[:, np.newaxis]
            mixed = (1.0 - part) * points[i - 1] + part * points[i] if d else points[:0]
            points = np.concatenate([points[: k - d + 1], mixed, points[k:]])
            knots = np.insert(knots, k + 1, knot)
        return BsplineTrajectory(knots, points)

    def piecewise_polynomial(self) -> PiecewisePolynomial:
        """Return the same curve as Bézier curves between its knots."""
        d, knots = self.degree, self.knots
        spans = np.arange(d, len(self.control_points))
        spans = spans[knots[spans] < knots[spans + 1]]
        points = []
        for j in range(d + 1):
            ends = [knots[spans]] * (d - j) + [knots[spans + 1]] * j
            places = np.stack(ends, axis=1) if d else np.zeros((len(spans), 0))
            points.append(self._blossom(spans, places))
        breaks = np.append(knots[spans], self.end_time)
        return PiecewisePolynomial(breaks, np.stack(points, axis=1))

    def reverse_time(self) -> BsplineTrajectory:
        """Return the reversed curve r with ``r(start_time + end_time - t) = q(t)``."""
        knots = (self.start_time + self.end_time) - self.knots[::-1]
        return BsplineTrajectory(knots, self.control_points[::-1])

    def scale_time(self, factor: float) -> BsplineTrajectory:
        """Return the slower curve r with ``r(factor * t) = q(t)``; the factor is positive."""
        return BsplineTrajectory(as_positive("factor", factor) * self.knots, self.control_points)

    def shift_right(self, offset: float) -> BsplineTrajectory:
        """Return the curve later by ``offset``."""
        return BsplineTrajectory(self.knots + as_finite("offset", offset), self.control_points)
