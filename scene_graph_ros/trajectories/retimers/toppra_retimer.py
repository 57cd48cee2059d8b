"""TOPP-RA in place of our own search for the fastest motion along a path."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.trajectories.corners import CornerPath
from scene_graph_ros.trajectories.errors import RetimingError, TrajectoryError
from scene_graph_ros.trajectories.motion_limits import MotionLimits
from scene_graph_ros.trajectories.motion_of_speeds import motion_of_speeds
from scene_graph_ros.trajectories.path_parameterized_trajectory import (
    PathParameterizedTrajectory,
)
from scene_graph_ros.trajectories.piecewise_polynomial import PiecewisePolynomial
from scene_graph_ros.trajectories.retimer import as_grid_points, Retimer
from scene_graph_ros.trajectories.retimers.retimer_libraries import get_toppra
from scene_graph_ros.trajectories.smooth_pieces import smooth_pieces

__all__ = ["ToppraRetimer"]

_WAYS = ("path", "spline")


@one_line()
@dataclass(frozen=True)
class ToppraRetimer(Retimer):
    """TOPP-RA as a retimer of `time_path` and `time_curve` (Pham and Pham, 2018).

    Each segment of a path is cut into ``grid_points`` stretches with one speedup each, straight
    ones, too; at their ends TOPP-RA keeps velocities and accelerations. With ``along="path"``
    it goes along the path, its corners rounded as for our own. With ``"spline"`` it goes along
    the cubic spline through the path's points, which leaves the path by as much as it swings.

    It knows no limits of jerk: these are kept by a mean over a rise time, as for our own. Raises
    TrajectoryError for options that make no sense.
    """

    grid_points: int = 50
    along: str = "path"

    def __post_init__(self) -> None:
        """Check the options."""
        object.__setattr__(self, "grid_points", as_grid_points(self.grid_points))
        if self.along not in _WAYS:
            raise TrajectoryError(
                f"along must be one of {', '.join(map(repr, _WAYS))}, not {quoted(self.along)}"
            )

    def curve(
        self, configurations: NDArray[np.float64], units: NDArray[np.float64]
    ) -> PiecewisePolynomial | None:
        """Return the cubic spline through a path's points ``(n, k)``, if it is asked for."""
        if self.along != "spline":
            return None
        corners = CornerPath(configurations, units)
        knots = np.concatenate([[0.0], corners.lengths.cumsum()])
        if len(knots) < 2:
            return None
        spline = get_toppra().interpolator.SplineInterpolator(knots, corners.points).cspl
        assert isinstance(spline, CubicSpline)
        return PiecewisePolynomial.cubic_hermite(knots, spline(knots), spline(knots, 1))

    def finer(self) -> ToppraRetimer:
        """Return it with twice as many stretches."""
        return replace(self, grid_points=2 * self.grid_points)

    def motion(
        self, path: PiecewisePolynomial, limits: MotionLimits
    ) -> PathParameterizedTrajectory:
        """Return TOPP-RA's motion, piece by piece between corners, where it rests.

        Raises RetimingError where it finds none, MissingRetimerError.
        """
        nodes, speeds = [np.array([path.start_time])], [np.zeros(1)]
        for piece in smooth_pieces(path):
            s, sd = self._speeds(piece, limits)
            nodes.append(s[1:])
            speeds.append(sd[1:])
        return motion_of_speeds(path, np.concatenate(nodes), np.concatenate(speeds))

    def _speeds(
        self, piece: PiecewisePolynomial, limits: MotionLimits
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return nodes on a smooth piece, and TOPP-RA's speeds there.

        Its tolerances are absolute, so the piece is 1 long, and about as much time passes.
        """
        algorithm, constraint, _ = get_toppra()
        low, high = piece.breaks[:-1], piece.breaks[1:]
        nodes = np.append(
            np.linspace(low, high, self.grid_points, endpoint=False, axis=1).ravel(), high[-1]
        )
        width, v, a = piece.duration, limits.velocities, limits.accelerations
        ways = np.abs(np.diff(piece.control_points, axis=1)).sum(axis=(0, 1))
        unit = float(np.maximum(ways / v, np.sqrt(ways / a)).max())
        bounds = [np.stack([-most, most], axis=1) for most in (unit * v, unit**2 * a)]
        instance = algorithm.TOPPRA(
            [
                constraint.JointVelocityConstraint(bounds[0]),
                constraint.JointAccelerationConstraint(bounds[1]),
            ],
            _path_class()(piece),
            gridpoints=(nodes - piece.start_time) / width,
        )
        _, speeds, _ = instance.compute_parameterization(0.0, 0.0)
        is_found = speeds is not None and np.isfinite(speeds).all()
        if not is_found or (speeds[1:-1] <= 0.0).any():
            why = instance.problem_data.return_code
            raise RetimingError(f"TOPP-RA found no speeds along the path: {why}")
        return nodes, speeds * (width / unit)


@cache
def _path_class() -> type[Any]:
    """Return the class of our paths as TOPP-RA takes them: q(s), s from 0 to 1."""
    base: Any = get_toppra().interpolator.AbstractGeometricPath

    class Path(base):
        def __init__(self, piece: PiecewisePolynomial) -> None:
            width = piece.duration
            self._curves = [width**order * piece.derivative(order) for order in range(3)]
            self._start, self._width = piece.start_time, width

        def __call__(self, path_positions: Any, order: int = 0) -> NDArray[np.float64]:
            s = self._start + self._width * np.asarray(path_positions, dtype=np.float64)
            return self._curves[order].value(s)

        @property
        def dof(self) -> int:
            return self._curves[0].rows

        @property
        def path_interval(self) -> NDArray[np.float64]:
            return np.array([0.0, 1.0])

    return Path
