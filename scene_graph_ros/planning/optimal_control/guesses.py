"""Trajectories from which a search begins."""

from __future__ import annotations

from typing import Any

import numpy as np

from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.planning.optimal_control.errors import TrajectoryOptimizationError
from scene_graph_ros.trajectories.piecewise_polynomial import PiecewisePolynomial
from scene_graph_ros.trajectories.trajectory import Trajectory

__all__ = ["as_guess", "check_continuous"]

_JUMP = 1e-6
"""Of the size of what jumps, and absolute: less is rounding."""


def as_guess(name: str, curve: Any, rows: int) -> Any:
    """Return a trajectory of so many rows, or None. Raises TrajectoryOptimizationError."""
    if curve is None:
        return None
    if not isinstance(curve, Trajectory) or curve.rows != rows:
        what = f"one of {curve.rows}" if isinstance(curve, Trajectory) else quoted(curve)
        raise TrajectoryOptimizationError(
            f"{name} must be a trajectory of {rows} rows, not {what}"
        )
    return curve


def check_continuous(name: str, curve: Any) -> None:
    """Raise TrajectoryOptimizationError where a curve jumps, naming the time and by how much."""
    if curve is None:
        return
    if not isinstance(curve, PiecewisePolynomial) and hasattr(curve, "piecewise_polynomial"):
        curve = curve.piecewise_polynomial()
    if not isinstance(curve, PiecewisePolynomial):
        return
    points = curve.control_points
    jumps = abs(points[1:, 0] - points[:-1, -1]).max(axis=1, initial=0.0)
    sizes = 1.0 + abs(points).max(axis=(1, 2), initial=0.0)[1:]
    bad = jumps > _JUMP * sizes
    if bad.any():
        k = int(np.argmax(bad))
        raise TrajectoryOptimizationError(
            f"{name} jumps by {jumps[k]:.3g} at t = {curve.breaks[k + 1]:.6g} s: give a continuous"
            " guess, such as PiecewisePolynomial.first_order_hold of its values"
        )
