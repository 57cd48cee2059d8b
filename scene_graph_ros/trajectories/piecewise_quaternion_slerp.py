"""Orientations that turn evenly from one to the next (slerp)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.trajectories.arguments import (
    as_breaks,
    as_finite,
    as_numbers,
    as_order,
    as_positive,
    as_times,
)
from scene_graph_ros.trajectories.errors import TrajectoryError
from scene_graph_ros.trajectories.piecewise_polynomial import PiecewisePolynomial
from scene_graph_ros.trajectories.segment_lookup import segments_at

__all__ = ["PiecewiseQuaternionSlerp"]

_OFF = 1e-6
"""By how much the length of a quaternion that is given may be off 1."""

_SMALL = 1e-8
"""rad: below it the sine of an angle is the angle, to double precision."""


@one_line()
@dataclass(frozen=True, eq=False)
class PiecewiseQuaternionSlerp:
    """``quaternions`` ``(p + 1, 4)``, x, y, z and w, at breaks ``(p + 1,)`` that grow, s.

    Between two of them it turns at a constant angular velocity, the shorter way (Shoemake,
    "Animating rotation with quaternion curves", 1985). Raises TrajectoryError for other shapes,
    and for quaternions that are not of length 1; they are normalized.
    """

    breaks: NDArray[np.float64]
    quaternions: NDArray[np.float64]

    def __post_init__(self) -> None:
        """Check and freeze the arrays."""
        breaks = as_breaks(self.breaks)
        quaternions = as_numbers("quaternions", self.quaternions)
        if quaternions.shape != (len(breaks), 4):
            raise TrajectoryError(
                f"quaternions must have shape ({len(breaks)}, 4), not {quaternions.shape}"
            )
        lengths = np.linalg.norm(quaternions, axis=1)
        if (abs(lengths - 1.0) > _OFF).any():
            k = int(np.argmax(abs(lengths - 1.0)))
            raise TrajectoryError(f"quaternions[{k}] must have the length 1, not {lengths[k]}")
        quaternions = quaternions / lengths[:, np.newaxis]
        for name, array in (("breaks", breaks), ("quaternions", quaternions)):
            array.setflags(write=False)
            object.__setattr__(self, name, array)

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
        """The dimension of its values: 4."""
        return 4

    @cached_property
    def _turns(self) -> NDArray[np.float64]:
        """Rotation vectors ``(p, 3)`` from each orientation to the next, in the frame of it."""
        first, second = self.quaternions[:-1], self.quaternions[1:]
        between = _product(first * [-1.0, -1.0, -1.0, 1.0], second)
        between = np.where(between[:, 3:] < 0.0, -between, between)
        sines = np.linalg.norm(between[:, :3], axis=1)
        angles = 2.0 * np.arctan2(sines, between[:, 3])
        scales = np.where(sines > 0.0, angles / np.where(sines > 0.0, sines, 1.0), 2.0)
        return np.asarray(scales[:, np.newaxis] * between[:, :3])

    def value(self, t: ArrayLike) -> NDArray[np.float64]:
        """Return quaternions ``(m, 4)`` at times ``(m,)``, or ``(4,)`` at one time, with w >= 0.

        Before the start and after the end it is that at the start and at the end.
        """
        times, k, share = self._places(t)
        turns = share[:, np.newaxis] * self._turns[k]
        result = _product(self.quaternions[k], _of_turns(turns))
        result = np.where(result[:, 3:] < 0.0, -result, result)
        return np.asarray(result if times.ndim else result[0])

    def orientation(self, t: ArrayLike) -> NDArray[np.float64]:
        """Return the same as `value`."""
        return self.value(t)

    def angular_velocity(self, t: ArrayLike) -> NDArray[np.float64]:
        """Return angular velocities in the world ``(m, 3)`` or ``(3,)``, rad/s.

        At a break it is that of the next segment; it goes on before the start and after the end.
        """
        return self.derivative().value(t)

    def angular_acceleration(self, t: ArrayLike) -> NDArray[np.float64]:
        """Return zeros ``(m, 3)`` or ``(3,)``: all of it is at the breaks."""
        return np.zeros((*as_times(t).shape, 3))

    def derivative(self, order: int = 1) -> PiecewiseQuaternionSlerp | PiecewisePolynomial:
        """Return itself for the order 0; of 1 angular velocities ``(3,)``, then derivatives."""
        count = as_order("order", order)
        if not count:
            return self
        rates = self._turns / np.diff(self.breaks)[:, np.newaxis]
        omega = _turned(self.quaternions[:-1], rates)
        return PiecewisePolynomial(self.breaks, omega[:, np.newaxis]).derivative(count - 1)

    def reverse_time(self) -> PiecewiseQuaternionSlerp:
        """Return the reversed curve r with ``r(start_time + end_time - t) = q(t)``."""
        breaks = (self.start_time + self.end_time) - self.breaks[::-1]
        return PiecewiseQuaternionSlerp(breaks, self.quaternions[::-1])

    def scale_time(self, factor: float) -> PiecewiseQuaternionSlerp:
        """Return the slower curve r with ``r(factor * t) = q(t)``; the factor is positive."""
        return PiecewiseQuaternionSlerp(
            as_positive("factor", factor) * self.breaks, self.quaternions
        )

    def shift_right(self, offset: float) -> PiecewiseQuaternionSlerp:
        """Return the curve later by ``offset``."""
        return PiecewiseQuaternionSlerp(
            self.breaks + as_finite("offset", offset), self.quaternions
        )

    def _places(
        self, t: ArrayLike
    ) -> tuple[NDArray[np.float64], NDArray[np.intp], NDArray[np.float64]]:
        times = as_times(t)
        flat = np.atleast_1d(times).clip(self.start_time, self.end_time)
        k = segments_at(self.breaks, flat)
        return times, k, (flat - self.breaks[k]) / np.diff(self.breaks)[k]


def _product(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return products of quaternions ``(m, 4)``: first b turns, then a."""
    u, v, s, r = a[:, :3], b[:, :3], a[:, 3:], b[:, 3:]
    vector = s * v + r * u + np.cross(u, v)
    scalar = s * r - (u * v).sum(axis=1, keepdims=True)
    return np.concatenate([vector, scalar], axis=1)


def _of_turns(turns: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the quaternions of rotation vectors ``(m, 3)``."""
    angles = np.linalg.norm(turns, axis=1, keepdims=True)
    is_small = angles < _SMALL
    scale = np.where(is_small, 0.5, np.sin(0.5 * angles) / np.where(is_small, 1.0, angles))
    return np.concatenate([scale * turns, np.cos(0.5 * angles)], axis=1)


def _turned(quaternions: NDArray[np.float64], v: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return vectors ``(m, 3)`` turned by quaternions."""
    u, s = quaternions[:, :3], quaternions[:, 3:]
    across = 2.0 * np.cross(u, v)
    return np.asarray(v + s * across + np.cross(u, across))
