"""The fastest trajectory along a path under limits of velocity and acceleration."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.reals import as_float
from scene_graph_ros.trajectories.errors import RetimingError, TrajectoryError
from scene_graph_ros.trajectories.motion_limits import MotionLimits
from scene_graph_ros.trajectories.motion_of_speeds import motion_of_speeds
from scene_graph_ros.trajectories.path_parameterized_trajectory import (
    PathParameterizedTrajectory,
)
from scene_graph_ros.trajectories.piecewise_polynomial import PiecewisePolynomial
from scene_graph_ros.trajectories.polynomials_of import Polynomials, polynomials_of
from scene_graph_ros.trajectories.smooth_pieces import corners_of
from scene_graph_ros.trajectories.time_optimal_kernels import (
    fastest_squared_speeds,
    Stretches,
)

__all__ = ["GRID_POINTS", "retime", "straight_segments"]

GRID_POINTS = 32
"""Stretches of a curved segment with one speedup each."""

_SMOOTH = 1e-9
"""Relative: what differs by less is the same, but for rounding."""

_BENT = 2.0
"""A segment whose direction changes by less than half of it takes fewer stretches."""

_OF_PIECE = 2.0
"""A segment that is less than half of its way from one corner to the next, too."""

_NO_PEAK = 1e-4
"""Relative: where a stretch's squared speeds differ by less, no faster phase inside of it is worth
its points."""

_ROUNDING = 8.0 * np.finfo(np.float64).eps
"""Of a segment's coordinates: control points that are so near to a straight line are on it."""

_FASTEST = 1e150
"""Squares of larger numbers may be infinite."""


def retime(
    path: Polynomials,
    limits: MotionLimits,
    *,
    grid_points: int = GRID_POINTS,
    start_speed: float = 0.0,
    end_speed: float = 0.0,
) -> PathParameterizedTrajectory:
    """Return the fastest trajectory along a path q(s), starting at 0 s.

    It begins and ends at rest, or with ds/dt of ``start_speed`` and ``end_speed``.

    Along straight segments it is the exact optimum; along a curved one it speeds up or slows down
    evenly on each of ``grid_points`` equal stretches. It stops at corners, where the path's
    direction jumps. Along segments up to degree 2 the limits hold at all times, to rounding; along
    others at the ends of all stretches, and `find_excess` has the excess between them.

    Raises TrajectoryError for limits of another dimension, and for a path that is no polynomials,
    that jumps or has a segment that goes nowhere; RetimingError for speeds that are too fast.
    """
    number = as_float(grid_points)
    if number is None or number < 1.0 or not number.is_integer():
        raise TrajectoryError(
            f"grid_points must be a whole number from 1 on, not {quoted(grid_points)}"
        )
    path = polynomials_of("path", path)
    if path.rows != len(limits.velocities):
        raise TrajectoryError(
            f"the path has {path.rows} rows, and there are limits of {len(limits.velocities)}"
        )
    points = path.control_points
    sizes = np.abs(points).max(axis=(0, 1))
    if (np.abs(points[1:, 0] - points[:-1, -1]) > _SMOOTH * sizes).any():
        raise TrajectoryError("the path jumps between two of its segments")
    still = (np.ptp(points, axis=1) == 0.0).all(axis=1)
    if still.any():
        raise TrajectoryError(f"segment {int(np.argmax(still))} of the path goes nowhere")
    return _Stretches(path, limits, int(number)).trajectory(start_speed, end_speed)


class _Stretches:
    """A path cut into stretches with one speedup each, but for straight ones."""

    def __init__(self, path: PiecewisePolynomial, limits: MotionLimits, grid: int) -> None:
        self.path, self.limits = path, limits
        is_straight = straight_segments(path)
        corners = corners_of(path)
        counts = np.where(is_straight, 1, _stretches(path, limits, corners, grid))
        self.corners = counts.cumsum()[corners - 1]
        nodes = [
            np.linspace(low, high, count, endpoint=False)
            for low, high, count in zip(path.breaks[:-1], path.breaks[1:], counts, strict=True)
        ]
        self.nodes = np.concatenate([*nodes, path.breaks[-1:]])
        self.steps = np.diff(self.nodes)
        self.straight = np.repeat(is_straight, counts)
        first = self._at_ends(path.derivative(), counts)
        second = self._at_ends(path.derivative(2), counts)
        second[self.straight] = 0.0
        first[self.straight] = 0.5 * first[self.straight].sum(axis=1, keepdims=True)
        self.first, self.second = first, second
        ways = np.diff(self._at_ends(path, counts), axis=1)[:, 0]
        self.mean = np.abs(ways) / self.steps[:, np.newaxis]
        self.rates = _least_ratio(limits.accelerations, first[:, 0])

    def _at_ends(
        self, curve: PiecewisePolynomial, counts: NDArray[np.int64]
    ) -> NDArray[np.float64]:
        """Return a curve's values ``(k, 2, n)`` at both ends of each stretch, of its segment."""
        segments = np.repeat(np.arange(curve.num_segments), counts)
        low, high = curve.breaks[segments], curve.breaks[segments + 1]
        result = np.empty((len(segments), 2, curve.rows))
        for end, s in enumerate((self.nodes[:-1], self.nodes[1:])):
            part = ((s - low) / (high - low))[:, np.newaxis, np.newaxis]
            points = curve.control_points[segments]
            while points.shape[1] > 1:
                points = (1.0 - part) * points[:, :-1] + part * points[:, 1:]
            result[:, end] = points[:, 0]
        return result

    def trajectory(self, start: float, end: float) -> PathParameterizedTrajectory:
        """Return the fastest trajectory, with some speeds at both ends. Raises RetimingError."""
        count = len(self.steps)
        caps, most, x = self._caps(), np.empty(count + 1), np.empty(count + 1)
        _demand_within("start", start**2, caps[0])
        _demand_within("end", end**2, caps[-1])
        caps[[0, -1]] = start**2, end**2
        limits = np.array(self.limits.accelerations)
        stretches = Stretches(
            self.steps, self.straight, self.rates, self.first, self.second, limits
        )
        fastest_squared_speeds(stretches, caps, most, x)
        _demand_within("start", start**2, most[0])
        _demand_within("end", end**2, x[-1])
        s, squares = self._with_peaks(x)
        return motion_of_speeds(self.path, s, np.sqrt(squares))

    def _caps(self) -> NDArray[np.float64]:
        """Return the largest squared speeds ``(k + 1,)`` at the nodes by the limits of velocity.

        Between two nodes the squared speed is a straight line over s. A limit is a convex function
        of s where q' is linear, so its tangent in the middle is below it, and the line below that
        tangent; where q' changes too much for it, the least value of both ends is taken, and of
        the stretch as a whole, as q' may vanish at both.
        """
        v = self.limits.velocities
        rates = np.abs(self.first)
        largest, mean = rates.max(axis=1), np.abs(0.5 * self.first.sum(axis=1))
        ends = np.empty_like(rates)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            flat = np.minimum(v / np.maximum(largest, self.mean), _FASTEST) ** 2
            for end in range(2):
                tangent = np.minimum(v / mean, _FASTEST) ** 2 * (3.0 - 2.0 * rates[:, end] / mean)
                has_one = (rates.min(axis=1) > 0.75 * mean) & (largest < 1.25 * mean)
                ends[:, end] = np.where(has_one, tangent, flat)
        by_stretch = ends.min(axis=2)
        caps = np.full(len(self.nodes), np.inf)
        caps[:-1] = by_stretch[:, 0]
        caps[1:] = np.minimum(caps[1:], by_stretch[:, 1])
        caps[self.corners] = 0.0
        return caps

    def _with_peaks(self, x: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
        """Return nodes and squared speeds, with those inside straight stretches.

        There it speeds up as much as it may, goes on as fast as it may, and slows down.
        """
        top = _least_ratio(self.limits.velocities, self.first[:, 0]) ** 2
        peak = np.minimum(0.5 * (x[:-1] + x[1:]) + self.rates * self.steps, top)
        peak = np.maximum(peak, np.maximum(x[:-1], x[1:]))
        up = (peak - x[:-1]) / (2.0 * self.rates)
        down = (peak - x[1:]) / (2.0 * self.rates)
        low, high = self.nodes[:-1], self.nodes[1:]
        first, last = low + up, np.maximum(high - down, low + up)
        s, squares = [self.nodes[:1]], [x[:1]]
        for k in range(len(self.steps)):
            if self.straight[k] and peak[k] > (1.0 + _NO_PEAK) * min(x[k], x[k + 1]):
                inner = [(first[k], peak[k])]
                if last[k] - first[k] > _SMOOTH * self.steps[k]:
                    inner.append((last[k], peak[k]))
                for place, square in inner:
                    # Also where it is the end, but for rounding: its speed is another one.
                    s.append(np.clip([place], low[k], high[k]))
                    squares.append(np.array([square]))
            s.append(high[k : k + 1])
            squares.append(x[k + 1 : k + 2])
        return np.concatenate(s), np.concatenate(squares)


def _stretches(
    path: PiecewisePolynomial, limits: MotionLimits, corners: NDArray[np.intp], grid: int
) -> NDArray[np.int64]:
    """Return in how many stretches ``(n,)`` each segment is cut, up to ``grid``, or 2.

    They are fewer where it hardly bends and is short: speeds change along its piece from one
    corner to the next. On a piece that is one segment there are at least two, as no single speedup
    leads from rest to rest.
    """
    bends = np.abs(np.diff(path.control_points, 2, axis=1)).sum(axis=1)
    ways = np.abs(np.diff(path.control_points, axis=1)).sum(axis=1)
    seconds = (ways / limits.velocities).max(axis=1)
    turns = (bends / limits.velocities).max(axis=1) / seconds
    begins = np.concatenate([[0], corners])
    sizes = np.diff(np.append(begins, path.num_segments))
    share = seconds / np.repeat(np.add.reduceat(seconds, begins), sizes)
    needed = np.ceil(grid * np.maximum(_BENT * path.degree * turns, _OF_PIECE * share))
    least = np.where(np.repeat(sizes, sizes) == 1, 2, 1)
    return np.maximum(needed.clip(1, grid), least).astype(np.int64)


def _demand_within(where: str, square: float, most: float) -> None:
    """Raise RetimingError where a squared speed at an end is more than it may be."""
    if square > most * (1.0 + _SMOOTH):
        share = np.sqrt(most / square)
        raise RetimingError(
            f"the velocity at the {where} is too fast for the path and the limits of velocity and"
            f" acceleration: at most {share:.3g} of it is possible"
        )


def straight_segments(path: PiecewisePolynomial) -> NDArray[np.bool_]:
    """Return a mask of segments that are straight and evenly parameterized, but for rounding."""
    points = path.control_points
    if points.shape[1] < 3:
        return np.ones(len(points), dtype=np.bool_)
    bends = np.abs(np.diff(points, 2, axis=1))
    size = np.abs(points).max(axis=1, keepdims=True)
    result: NDArray[np.bool_] = (bends <= _ROUNDING * size).all(axis=(1, 2))
    return result


def _least_ratio(limits: NDArray[np.float64], rates: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the least of limits over rates ``(k, n)``, those that are 0 left out."""
    with np.errstate(divide="ignore", over="ignore"):
        return np.minimum((limits / np.abs(rates)).min(axis=1), _FASTEST)
