"""A trajectory as controllers take it: points in time, and the curve through them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.real_arrays import real_array, whole_array
from scene_graph_ros.trajectories.arguments import as_order
from scene_graph_ros.trajectories.errors import TrajectoryError
from scene_graph_ros.trajectories.piecewise_polynomial import PiecewisePolynomial
from scene_graph_ros.trajectories.trajectory import Trajectory

__all__ = ["TrajectoryPoints"]


@one_line()
@dataclass(frozen=True, eq=False)
class TrajectoryPoints:
    """Points that a trajectory passes, with its derivatives there.

    ``nanoseconds`` ``(m,)`` grow. ``positions`` are ``(m, n)``, as are ``velocities`` and
    ``accelerations`` where they are there. Between points it is the curve that ROS 2's
    joint_trajectory_controller runs: lines, with velocities cubics, with accelerations quintics.

    Raises TrajectoryError for other shapes, times that do not grow, and infinities.
    """

    nanoseconds: NDArray[np.int64]
    positions: NDArray[np.float64]
    velocities: NDArray[np.float64] | None = None
    accelerations: NDArray[np.float64] | None = None

    def __post_init__(self) -> None:
        """Check and freeze the arrays."""
        rule = "nanoseconds must be whole numbers (m,)"
        times = whole_array(self.nanoseconds, rule, TrajectoryError)
        if times.ndim != 1 or not len(times):
            raise TrajectoryError(f"nanoseconds must have shape (m,), not {times.shape}")
        if not (np.diff(times) > 0).all():
            i = int(np.argmin(np.diff(times)))
            raise TrajectoryError(
                f"times must grow: point {i} is at {times[i]} ns, the next at {times[i + 1]} ns"
            )
        if self.accelerations is not None and self.velocities is None:
            raise TrajectoryError("points with accelerations must have velocities")
        shape = None
        for name in ("positions", "velocities", "accelerations"):
            given = getattr(self, name)
            if given is None and name != "positions":
                continue
            array = real_array(given, f"{name} must be numbers", TrajectoryError)
            shape = shape or array.shape
            if array.ndim != 2 or array.shape != shape or len(array) != len(times):
                raise TrajectoryError(
                    f"{name} must have shape ({len(times)}, n), not {array.shape}"
                )
            if not np.isfinite(array).all():
                row, column = np.argwhere(~np.isfinite(array))[0]
                raise TrajectoryError(
                    f"{name}[{row}, {column}] must be finite, not {array[row, column]}"
                )
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        times.setflags(write=False)
        object.__setattr__(self, "nanoseconds", times)

    @classmethod
    def of_curve(
        cls, curve: Trajectory, nanoseconds: ArrayLike, derivatives: int = 2
    ) -> TrajectoryPoints:
        """Return a curve and as many of its derivatives, 0 to 2, at times ``(m,)`` in ns.

        Whether the curve through the points keeps limits is for `find_excess`, and whether it is
        free for `prove_trajectory`. Raises TrajectoryError for times that are no whole numbers or
        outside of the curve, and for other numbers of derivatives.
        """
        count = as_order("derivatives", derivatives)
        if count > 2:
            raise TrajectoryError(f"derivatives must be 0, 1 or 2, not {count}")
        rule = "nanoseconds must be whole numbers (m,)"
        whole = whole_array(nanoseconds, rule, TrajectoryError)
        if whole.ndim != 1:
            raise TrajectoryError(f"{rule}, not of shape {whole.shape}")
        seconds = whole * 1e-9
        start, end = curve.start_time, curve.end_time
        is_outside = (seconds < start - 1e-9) | (seconds > end + 1e-9)
        if is_outside.any():
            raise TrajectoryError(
                f"nanoseconds lead to {seconds[is_outside][0]} s, but the curve is from {start} to"
                f" {end} s"
            )
        rows = (curve.derivative(order).value(seconds) for order in range(count + 1))
        return cls(whole, *rows)

    @property
    def duration(self) -> float:
        """From the first point to the last, s."""
        return float(self.nanoseconds[-1] - self.nanoseconds[0]) * 1e-9

    def of(self, columns: NDArray[np.intp]) -> TrajectoryPoints:
        """Return some columns of the points, ``(k,)``."""
        velocities, accelerations = (
            None if each is None else each[:, columns]
            for each in (self.velocities, self.accelerations)
        )
        return TrajectoryPoints(
            self.nanoseconds, self.positions[:, columns], velocities, accelerations
        )

    def trajectory(self) -> PiecewisePolynomial:
        """Return the curve through the points, in s. Raises TrajectoryError for a single point."""
        times = self.nanoseconds * 1e-9
        if self.velocities is None:
            return PiecewisePolynomial.first_order_hold(times, self.positions)
        if self.accelerations is None:
            return PiecewisePolynomial.cubic_hermite(times, self.positions, self.velocities)
        return PiecewisePolynomial.quintic_hermite(
            times, self.positions, self.velocities, self.accelerations
        )
