"""Curves that are polynomials between breaks, with exact derivatives, for batches of times."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.trajectories.arguments import (
    as_breaks,
    as_finite,
    as_numbers,
    as_order,
    as_positive,
    as_times,
    is_same_time,
)
from scene_graph_ros.trajectories.bernstein import (
    differentiated,
    elevated,
    evaluated,
    multiplied,
)
from scene_graph_ros.trajectories.errors import TrajectoryError
from scene_graph_ros.trajectories.interpolants import (
    lagrange_points,
    monotone_slopes,
    smooth_slopes,
)
from scene_graph_ros.trajectories.segment_lookup import segments_at

__all__ = ["PiecewisePolynomial"]


@one_line()
@dataclass(frozen=True, eq=False)
class PiecewisePolynomial:
    """A curve in n dimensions: a polynomial of one degree on each of p segments.

    ``breaks`` ``(p + 1,)`` grow, in s or the parameter's unit. ``control_points``
    ``(p, degree + 1, n)`` are each segment's Bézier points (Bernstein's basis), so the curve is
    in their hull, and its derivatives in the hulls of their differences (Farin, *Curves and
    Surfaces for CAGD*, 2002, chapters 4 and 5). Segments need not fit together.

    Raises TrajectoryError for other shapes, for infinities and for breaks that do not grow.
    """

    breaks: NDArray[np.float64]
    control_points: NDArray[np.float64]

    def __post_init__(self) -> None:
        """Check and freeze the arrays."""
        breaks = as_breaks(self.breaks)
        points = as_numbers("control_points", self.control_points)
        if points.ndim != 3 or len(points) != len(breaks) - 1 or not points.shape[1]:
            raise TrajectoryError(
                f"control_points must have shape ({len(breaks) - 1}, degree + 1, n), one segment"
                f" between two breaks, not {points.shape}"
            )
        for name, array in (("breaks", breaks), ("control_points", points)):
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    # Made of what is known of it.

    @classmethod
    def zero_order_hold(cls, breaks: ArrayLike, samples: ArrayLike) -> PiecewisePolynomial:
        """Return steps that keep each of ``samples`` ``(p + 1, n)`` until the next break.

        The last sample is none of them, as nothing comes behind it.
        """
        t, q = _samples(breaks, samples=samples)
        return cls(t, q[:-1, np.newaxis])

    @classmethod
    def first_order_hold(cls, breaks: ArrayLike, samples: ArrayLike) -> PiecewisePolynomial:
        """Return straight lines through ``samples`` ``(p + 1, n)`` at the breaks."""
        t, q = _samples(breaks, samples=samples)
        return cls(t, np.stack([q[:-1], q[1:]], axis=1))

    @classmethod
    def cubic_hermite(
        cls, breaks: ArrayLike, samples: ArrayLike, samples_dot: ArrayLike
    ) -> PiecewisePolynomial:
        """Return cubics with values and derivatives ``(p + 1, n)`` at the breaks."""
        t, q, v = _samples(breaks, samples=samples, samples_dot=samples_dot)
        third = np.diff(t)[:, np.newaxis] / 3.0
        inner = q[:-1] + third * v[:-1], q[1:] - third * v[1:]
        return cls(t, np.stack([q[:-1], *inner, q[1:]], axis=1))

    @classmethod
    def cubic_shape_preserving(
        cls,
        breaks: ArrayLike,
        samples: ArrayLike,
        *,
        zero_end_point_derivatives: bool = False,
    ) -> PiecewisePolynomial:
        """Return cubics that rise and fall between ``samples`` ``(p + 1, n)`` just as these do.

        So each stays between its two samples (Fritsch and Butland, 1984). There must be three or
        more.
        """
        t, q = _samples(breaks, samples=samples)
        return cls.cubic_hermite(t, q, monotone_slopes(t, q, zero_end_point_derivatives))

    @classmethod
    def cubic_with_continuous_second_derivatives(
        cls,
        breaks: ArrayLike,
        samples: ArrayLike,
        sample_dot_at_start: ArrayLike | None = None,
        sample_dot_at_end: ArrayLike | None = None,
        *,
        periodic_end: bool = False,
    ) -> PiecewisePolynomial:
        """Return cubics through ``samples`` ``(p + 1, n)`` with accelerations without jumps.

        With the velocities ``(n,)`` at both ends, or repeating themselves with ``periodic_end``;
        else the first two are one cubic, and the last two ("not a knot").
        """
        t, q = _samples(breaks, samples=samples)
        given = sample_dot_at_start, sample_dot_at_end
        if (given[0] is None) != (given[1] is None) or (given[0] is not None and periodic_end):
            raise TrajectoryError(
                "sample_dot_at_start and sample_dot_at_end come together, and not with"
                " periodic_end"
            )
        ends = None
        if given[0] is not None and given[1] is not None:
            low = _as_row("sample_dot_at_start", given[0], q.shape[1])
            ends = low, _as_row("sample_dot_at_end", given[1], q.shape[1])
        return cls.cubic_hermite(t, q, smooth_slopes(t, q, ends, periodic_end))

    @classmethod
    def lagrange_interpolating_polynomial(
        cls, times: ArrayLike, samples: ArrayLike
    ) -> PiecewisePolynomial:
        """Return the one polynomial through ``samples`` ``(p + 1, n)`` at times, 20 at most.

        Between equal distances it swings far, the more the more samples there are.
        """
        t, q = _samples(times, "times", samples=samples)
        return cls(t[[0, -1]], lagrange_points(t, q)[np.newaxis])

    @classmethod
    def quintic_hermite(
        cls, breaks: ArrayLike, samples: ArrayLike, samples_dot: ArrayLike, samples_ddot: ArrayLike
    ) -> PiecewisePolynomial:
        """Return quintics with values and two derivatives ``(p + 1, n)`` at the breaks."""
        t, q, v, a = _samples(
            breaks, samples=samples, samples_dot=samples_dot, samples_ddot=samples_ddot
        )
        h = np.diff(t)[:, np.newaxis]
        inner = (
            q[:-1] + 0.2 * h * v[:-1],
            q[:-1] + h * (0.4 * v[:-1] + 0.05 * h * a[:-1]),
            q[1:] - h * (0.4 * v[1:] - 0.05 * h * a[1:]),
            q[1:] - 0.2 * h * v[1:],
        )
        return cls(t, np.stack([q[:-1], *inner, q[1:]], axis=1))

    # What it is.

    @property
    def start_time(self) -> float:
        """The first break."""
        return float(self.breaks[0])

    @property
    def end_time(self) -> float:
        """The last break."""
        return float(self.breaks[-1])

    @property
    def duration(self) -> float:
        """From the first break to the last."""
        return self.end_time - self.start_time

    @property
    def rows(self) -> int:
        """The dimension n."""
        return int(self.control_points.shape[2])

    @property
    def degree(self) -> int:
        """The degree of its polynomials."""
        return int(self.control_points.shape[1]) - 1

    @property
    def num_segments(self) -> int:
        """How many polynomials there are."""
        return len(self.control_points)

    def value(self, t: ArrayLike) -> NDArray[np.float64]:
        """Return the values ``(m, n)`` at times ``(m,)``, or ``(n,)`` at one time.

        At a break that is the next segment's value; before the start and after the end it is that
        at the start and at the end. Raises TrajectoryError for times that are no numbers.
        """
        times = as_times(t)
        flat = np.atleast_1d(times).clip(self.breaks[0], self.breaks[-1])
        segments = segments_at(self.breaks, flat)
        low, high = self.breaks[segments], self.breaks[segments + 1]
        result = evaluated(self.control_points[segments], (flat - low) / (high - low))
        return result if times.ndim else result[0]

    def derivative(self, order: int = 1) -> PiecewisePolynomial:
        """Return its derivative of an order from 0 on, segment by segment."""
        times = as_order("order", order)
        widths = np.diff(self.breaks)[:, np.newaxis, np.newaxis]
        points = differentiated(self.control_points, times) / widths**times
        return PiecewisePolynomial(self.breaks, points)

    def integral(self, value_at_start_time: ArrayLike = 0.0) -> PiecewisePolynomial:
        """Return the curve whose derivative this one is, of one degree more and without jumps.

        It begins with ``value_at_start_time``, a number or ``(n,)`` (Farin, section 5.3).
        """
        start = as_numbers("value_at_start_time", value_at_start_time)
        if start.shape not in ((), (self.rows,)):
            raise TrajectoryError(
                f"value_at_start_time must be a number or have shape ({self.rows},), not"
                f" {start.shape}"
            )
        widths = np.diff(self.breaks)[:, np.newaxis, np.newaxis] / (self.degree + 1)
        gains = np.cumsum(widths * self.control_points, axis=1)
        begins = start + np.cumsum(np.insert(gains[:-1, -1], 0, 0.0, axis=0), axis=0)
        points = np.insert(begins[:, np.newaxis] + gains, 0, begins, axis=1)
        return PiecewisePolynomial(self.breaks, points)

    # Others made of it.

    def slice(self, start_segment_index: int, num_segments: int) -> PiecewisePolynomial:
        """Return some segments one after another, at the times that they have.

        Raises TrajectoryError for segments that are not there.
        """
        first = as_order("start_segment_index", start_segment_index)
        last = first + as_order("num_segments", num_segments)
        if not first < last <= self.num_segments:
            raise TrajectoryError(
                f"start_segment_index {first} and num_segments {num_segments} must name one or"
                f" more of {self.num_segments} segments"
            )
        return PiecewisePolynomial(self.breaks[first : last + 1], self.control_points[first:last])

    def reverse_time(self) -> PiecewisePolynomial:
        """Return the reversed curve r with ``r(start_time + end_time - t) = q(t)``."""
        breaks = (self.start_time + self.end_time) - self.breaks[::-1]
        breaks[[0, -1]] = self.start_time, self.end_time
        return PiecewisePolynomial(breaks, self.control_points[::-1, ::-1])

    def scale_time(self, factor: float) -> PiecewisePolynomial:
        """Return the slower curve r with ``r(factor * t) = q(t)``; the factor is positive."""
        return PiecewisePolynomial(
            as_positive("factor", factor) * self.breaks, self.control_points
        )

    def shift_right(self, offset: float) -> PiecewisePolynomial:
        """Return the curve later by ``offset``."""
        return PiecewisePolynomial(self.breaks + as_finite("offset", offset), self.control_points)

    def concatenate_in_time(self, other: PiecewisePolynomial) -> PiecewisePolynomial:
        """Return this curve and, from its end on, another one that starts there.

        Raises TrajectoryError for one of another dimension, or that starts at another time.
        """
        if not isinstance(other, PiecewisePolynomial):
            raise TrajectoryError(
                f"what is concatenated must be a PiecewisePolynomial, not {quoted(other)}"
            )
        if other.rows != self.rows:
            raise TrajectoryError(f"a curve of {other.rows} rows can't follow one of {self.rows}")
        end, start = self.end_time, other.start_time
        if not is_same_time(end, start):
            raise TrajectoryError(f"a curve from {start} on can't follow one that ends at {end}")
        degree = max(self.degree, other.degree)
        points = [each.elevate_degree(degree).control_points for each in (self, other)]
        breaks = np.concatenate([self.breaks, other.breaks[1:]])
        return PiecewisePolynomial(breaks, np.concatenate(points))

    def elevate_degree(self, degree: int) -> PiecewisePolynomial:
        """Return the same curve with the control points of a degree that is no lower.

        Raises TrajectoryError for a lower one (Farin, section 6.1).
        """
        wanted = as_order("degree", degree, self.degree)
        return PiecewisePolynomial(self.breaks, elevated(self.control_points, wanted))

    # Combined with others.

    def _other(self, other: PiecewisePolynomial, what: str) -> PiecewisePolynomial:
        """Return another curve with the same breaks, with which it can be combined."""
        if not isinstance(other, PiecewisePolynomial):
            raise TrajectoryError(
                f"what is {what} must be a PiecewisePolynomial, not {quoted(other)}"
            )
        if not np.array_equal(other.breaks, self.breaks):
            raise TrajectoryError(
                f"curves are {what} that have the same breaks: {self.breaks} are not"
                f" {other.breaks}"
            )
        if other.rows != self.rows and 1 not in (other.rows, self.rows):
            raise TrajectoryError(f"curves of {self.rows} and {other.rows} rows can't be {what}")
        return other

    def __add__(self, other: PiecewisePolynomial) -> PiecewisePolynomial:
        """Return the sum with a curve of the same breaks, whose single row is added to each."""
        degree = max(self.degree, self._other(other, "added").degree)
        first, second = (each.elevate_degree(degree).control_points for each in (self, other))
        return PiecewisePolynomial(self.breaks, first + second)

    def __sub__(self, other: PiecewisePolynomial) -> PiecewisePolynomial:
        return self + -self._other(other, "subtracted")

    def __neg__(self) -> PiecewisePolynomial:
        return PiecewisePolynomial(self.breaks, -self.control_points)

    def __mul__(self, other: PiecewisePolynomial | float) -> PiecewisePolynomial:
        """Return the product with a number, or with a curve of the same breaks, row by row.

        A curve of a single row multiplies each row. The degree is the sum of both.
        """
        if not isinstance(other, PiecewisePolynomial):
            points = as_finite("a factor", other) * self.control_points
        else:
            more = self._other(other, "multiplied").control_points
            points = multiplied(self.control_points, more)
        return PiecewisePolynomial(self.breaks, points)

    __rmul__ = __mul__


def _as_row(name: str, values: ArrayLike, size: int) -> NDArray[np.float64]:
    row = as_numbers(name, values)
    if row.shape != (size,):
        raise TrajectoryError(f"{name} must have shape ({size},), not {row.shape}")
    return row


def _samples(
    breaks: ArrayLike, label: str = "breaks", **samples: ArrayLike
) -> list[NDArray[np.float64]]:
    """Return breaks ``(p + 1,)`` and the samples at each, ``(p + 1, n)`` alike."""
    t = as_breaks(breaks, label)
    result, shape = [t], None
    for name, values in samples.items():
        array = as_numbers(name, values)
        shape = shape or array.shape
        if array.ndim != 2 or len(array) != t.size or array.shape != shape:
            raise TrajectoryError(f"{name} must have shape ({t.size}, n), not {array.shape}")
        result.append(array)
    return result
