"""Curves that follow one another in time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
import itertools
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.trajectories.arguments import as_finite, as_order, as_times, is_same_time
from scene_graph_ros.trajectories.bernstein import elevated
from scene_graph_ros.trajectories.bezier_curve import BezierCurve
from scene_graph_ros.trajectories.bspline_trajectory import BsplineTrajectory
from scene_graph_ros.trajectories.errors import TrajectoryError
from scene_graph_ros.trajectories.piecewise_polynomial import PiecewisePolynomial
from scene_graph_ros.trajectories.trajectory import Trajectory

__all__ = ["CompositeTrajectory"]


@one_line()
@dataclass(frozen=True, eq=False)
class CompositeTrajectory:
    """``segments``, each of which begins when the one before it ends.

    They need not begin where the one before ends: `jumps` says how far from there, and of which
    derivative. Raises TrajectoryError where there is none, where one begins at another time, and
    for different dimensions.
    """

    segments: tuple[Trajectory, ...]

    def __post_init__(self) -> None:
        """Check that times and dimensions fit."""
        given: Any = self.segments
        if not isinstance(given, Sequence) or not given:
            raise TrajectoryError(
                f"segments must be one curve or more, not {quoted(self.segments)}"
            )
        for k, segment in enumerate(self.segments):
            if not isinstance(segment, Trajectory):
                raise TrajectoryError(f"segments[{k}] must be a curve, not {quoted(segment)}")
        for k, (first, second) in enumerate(itertools.pairwise(self.segments), start=1):
            if not is_same_time(first.end_time, second.start_time):
                raise TrajectoryError(
                    f"segments[{k}] begins at {second.start_time}, but the one before ends at"
                    f" {first.end_time}"
                )
            if first.rows != second.rows:
                raise TrajectoryError(
                    f"segments[{k}] has {second.rows} rows, the one before {first.rows}"
                )
        object.__setattr__(self, "segments", tuple(self.segments))

    @property
    def start_time(self) -> float:
        """When the first begins, s."""
        return self.segments[0].start_time

    @property
    def end_time(self) -> float:
        """When the last ends, s."""
        return self.segments[-1].end_time

    @property
    def duration(self) -> float:
        """How long all take, s."""
        return self.end_time - self.start_time

    @property
    def rows(self) -> int:
        """The dimension n."""
        return self.segments[0].rows

    @property
    def num_segments(self) -> int:
        """How many there are."""
        return len(self.segments)

    @property
    def breaks(self) -> NDArray[np.float64]:
        """When segments begin, and the last ends: ``(num_segments + 1,)``, s."""
        return np.array([*(each.start_time for each in self.segments), self.end_time])

    def value(self, t: ArrayLike) -> NDArray[np.float64]:
        """Return the values ``(m, n)`` at times ``(m,)``, or ``(n,)`` at one time.

        Where one segment ends and the next begins, the value is that of the next; before the
        start and after the end it is that at the start and at the end. Raises TrajectoryError for
        times that are no numbers.
        """
        times = as_times(t)
        flat = np.atleast_1d(times)
        inner = self.breaks[1:-1]
        result = np.empty((len(flat), self.rows))
        which = np.searchsorted(inner, flat, side="right")
        for k in np.unique(which):
            result[which == k] = self.segments[k].value(flat[which == k])
        return result if times.ndim else result[0]

    def derivative(self, order: int = 1) -> CompositeTrajectory:
        """Return its derivative of an order from 0 on, segment by segment."""
        return self._each(lambda segment: segment.derivative(order))

    def jumps(self, order: int = 0) -> NDArray[np.float64]:
        """Return by how much a derivative changes from each segment to the next.

        ``(num_segments - 1, n)``; of order 0 are the positions.
        """
        curves = self.derivative(order).segments
        return np.array(
            [b.value(b.start_time) - a.value(a.end_time) for a, b in itertools.pairwise(curves)]
        ).reshape(-1, self.rows)

    def is_continuous(self, order: int = 0, tolerance: float = 1e-9) -> bool:
        """Tell whether no entry of any derivative up to an order changes at once by more."""
        orders, most = range(as_order("order", order) + 1), as_finite("tolerance", tolerance)
        return all(bool((np.abs(self.jumps(each)) <= most).all()) for each in orders)

    # Others made of it.

    def _each(self, change: Callable[[Trajectory], Trajectory]) -> CompositeTrajectory:
        return CompositeTrajectory(tuple(change(segment) for segment in self.segments))

    def reverse_time(self) -> CompositeTrajectory:
        """Return the reversed curve r with ``r(start_time + end_time - t) = q(t)``."""
        both = self.start_time + self.end_time
        return CompositeTrajectory(
            tuple(
                each.reverse_time().shift_right(both - each.start_time - each.end_time)
                for each in reversed(self.segments)
            )
        )

    def scale_time(self, factor: float) -> CompositeTrajectory:
        """Return the slower curve r with ``r(factor * t) = q(t)``; the factor is positive."""
        return self._each(lambda segment: segment.scale_time(factor))

    def shift_right(self, offset: float) -> CompositeTrajectory:
        """Return the curve later by ``offset``."""
        later = as_finite("offset", offset)
        return self._each(lambda segment: segment.shift_right(later))

    def concatenate_in_time(self, other: Trajectory) -> CompositeTrajectory:
        """Return this curve and, from its end on, another one that starts there.

        Raises TrajectoryError for one of another dimension, or that starts at another time.
        """
        more = other.segments if isinstance(other, CompositeTrajectory) else (other,)
        return CompositeTrajectory((*self.segments, *more))

    def piecewise_polynomial(self) -> PiecewisePolynomial:
        """Return the same curve as polynomials of one degree, between breaks.

        So that `find_excess` and `retime` take it. Raises TrajectoryError for segments of other
        kinds than `BezierCurve`, `BsplineTrajectory` and `PiecewisePolynomial`.
        """
        breaks, points = [self.start_time], []
        for k, segment in enumerate(self.segments):
            if isinstance(segment, BsplineTrajectory):
                segment = segment.piecewise_polynomial()
            if isinstance(segment, BezierCurve):
                points.append(segment.control_points[np.newaxis])
                breaks.append(segment.end_time)
            elif isinstance(segment, PiecewisePolynomial):
                points.append(segment.control_points)
                breaks.extend(segment.breaks[1:].tolist())
            else:
                raise TrajectoryError(
                    f"segments[{k}] must be a BezierCurve, a BsplineTrajectory or a"
                    f" PiecewisePolynomial, not {quoted(segment)}"
                )
        degree = max(each.shape[1] for each in points) - 1
        return PiecewisePolynomial(
            np.array(breaks), np.concatenate([elevated(each, degree) for each in points])
        )
