"""Poses over time: positions that are polynomials, orientations that turn evenly."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.spatial.poses import (
    as_poses,
    poses_from_quaternions,
    quaternions_from_poses,
)
from scene_graph_ros.trajectories.arguments import (
    as_breaks,
    as_finite,
    as_numbers,
    as_order,
    as_times,
    is_same_time,
)
from scene_graph_ros.trajectories.errors import TrajectoryError
from scene_graph_ros.trajectories.piecewise_polynomial import PiecewisePolynomial
from scene_graph_ros.trajectories.piecewise_quaternion_slerp import PiecewiseQuaternionSlerp
from scene_graph_ros.trajectories.stacked_trajectory import StackedTrajectory

__all__ = ["PiecewisePose"]


@one_line()
@dataclass(frozen=True, eq=False)
class PiecewisePose:
    """Poses X_WB over time: ``position`` of three rows, m, and ``orientation``.

    Raises TrajectoryError for other rows and for curves over different times.
    """

    position: PiecewisePolynomial
    orientation: PiecewiseQuaternionSlerp

    def __post_init__(self) -> None:
        """Check that both fit."""
        position: Any = self.position
        orientation: Any = self.orientation
        if not isinstance(position, PiecewisePolynomial) or position.rows != 3:
            raise TrajectoryError(
                f"position must be a PiecewisePolynomial of 3 rows, not {quoted(position)}"
            )
        if not isinstance(orientation, PiecewiseQuaternionSlerp):
            raise TrajectoryError(
                f"orientation must be a PiecewiseQuaternionSlerp, not {quoted(orientation)}"
            )
        for name in ("start_time", "end_time"):
            own, other = getattr(self.position, name), getattr(self.orientation, name)
            if not is_same_time(own, other):
                raise TrajectoryError(f"orientation has the {name} {other}, position {own}")

    @classmethod
    def make_linear(cls, times: ArrayLike, poses: ArrayLike) -> PiecewisePose:
        """Return straight lines through poses ``(p + 1, 4, 4)``, m, turning evenly.

        Raises TrajectoryError for other times, InvalidPoseError for a matrix that is no pose.
        """
        t, X = _given(times, poses)
        return cls(
            PiecewisePolynomial.first_order_hold(t, X[:, :3, 3]),
            PiecewiseQuaternionSlerp(t, quaternions_from_poses(X)),
        )

    @classmethod
    def make_cubic_linear_with_end_linear_velocity(
        cls,
        times: ArrayLike,
        poses: ArrayLike,
        start_vel: ArrayLike = (0.0, 0.0, 0.0),
        end_vel: ArrayLike = (0.0, 0.0, 0.0),
    ) -> PiecewisePose:
        """Return cubics through the positions of poses ``(p + 1, 4, 4)``, turning evenly.

        Linear accelerations have no jumps; linear velocities ``(3,)`` at both ends are in m/s.
        Raises as `make_linear`.
        """
        t, X = _given(times, poses)
        for name, given in (("start_vel", start_vel), ("end_vel", end_vel)):
            velocity = as_numbers(name, given)
            if velocity.shape != (3,):
                raise TrajectoryError(f"{name} must have shape (3,), not {velocity.shape}")
        position = PiecewisePolynomial.cubic_with_continuous_second_derivatives(
            t, X[:, :3, 3], start_vel, end_vel
        )
        return cls(position, PiecewiseQuaternionSlerp(t, quaternions_from_poses(X)))

    @property
    def start_time(self) -> float:
        """When it begins, s."""
        return self.position.start_time

    @property
    def end_time(self) -> float:
        """When it ends, s."""
        return self.position.end_time

    @property
    def duration(self) -> float:
        """How long it takes, s."""
        return self.end_time - self.start_time

    def value(self, t: ArrayLike) -> NDArray[np.float64]:
        """Return poses ``(m, 4, 4)`` at times ``(m,)``, or ``(4, 4)`` at one time."""
        times = as_times(t)
        quaternions = np.atleast_2d(self.orientation.value(times))
        X = poses_from_quaternions(np.atleast_2d(self.position.value(times)), quaternions)
        return X if times.ndim else X[0]

    def get_pose(self, t: ArrayLike) -> NDArray[np.float64]:
        """Return the same as `value`."""
        return self.value(t)

    def get_velocity(self, t: ArrayLike) -> NDArray[np.float64]:
        """Return ``(m, 6)`` or ``(6,)``: angular velocity in W, rad/s, then that of the origin."""
        return self.derivative().value(t)

    def get_acceleration(self, t: ArrayLike) -> NDArray[np.float64]:
        """Return ``(m, 6)`` or ``(6,)``: angular acceleration in W, then that of the origin."""
        return self.derivative(2).value(t)

    def derivative(self, order: int = 1) -> StackedTrajectory:
        """Return velocities ``(6,)`` for the order 1, and their derivatives.

        Raises TrajectoryError for the order 0: poses have no rows.
        """
        count = as_order("order", order, 1)
        turning = self.orientation.derivative(count)
        assert isinstance(turning, PiecewisePolynomial)
        return StackedTrajectory((turning, self.position.derivative(count)))

    def is_approx(self, other: PiecewisePose, tolerance: float) -> bool:
        """Tell whether both have the same times and poses at their breaks, to a tolerance.

        Raises TrajectoryError for something else, and for a tolerance that is no number.
        """
        given: Any = other
        if not isinstance(given, PiecewisePose):
            raise TrajectoryError(f"other must be a PiecewisePose, not {quoted(given)}")
        near = as_finite("tolerance", tolerance)
        mine = np.union1d(self.position.breaks, self.orientation.breaks)
        theirs = np.union1d(other.position.breaks, other.orientation.breaks)
        if mine.shape != theirs.shape or (np.abs(mine - theirs) > near).any():
            return False
        middle = 0.5 * (mine[1:] + mine[:-1])
        apart = [np.abs(self.value(t) - other.value(t)).max() for t in (mine, middle)]
        return bool(max(apart) <= near)

    def reverse_time(self) -> PiecewisePose:
        """Return the reversed poses: those at ``start_time + end_time - t`` are these at t."""
        return PiecewisePose(self.position.reverse_time(), self.orientation.reverse_time())

    def scale_time(self, factor: float) -> PiecewisePose:
        """Return the slower poses: those at ``factor * t`` are these at t."""
        return PiecewisePose(self.position.scale_time(factor), self.orientation.scale_time(factor))

    def shift_right(self, offset: float) -> PiecewisePose:
        """Return the poses later by ``offset``."""
        return PiecewisePose(
            self.position.shift_right(offset), self.orientation.shift_right(offset)
        )


def _given(times: ArrayLike, poses: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    t = as_breaks(times, "times")
    X = as_poses(poses, "poses")
    if len(X) != len(t):
        raise TrajectoryError(f"poses must be one for each of {len(t)} times, not {len(X)}")
    return t, X
