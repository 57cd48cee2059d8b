"""Curves of all kinds that are polynomials between breaks, as one kind."""

from __future__ import annotations

from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.trajectories.bezier_curve import BezierCurve
from scene_graph_ros.trajectories.bspline_trajectory import BsplineTrajectory
from scene_graph_ros.trajectories.composite_trajectory import CompositeTrajectory
from scene_graph_ros.trajectories.errors import TrajectoryError
from scene_graph_ros.trajectories.piecewise_polynomial import PiecewisePolynomial

__all__ = ["Polynomials", "polynomials_of"]

Polynomials = PiecewisePolynomial | BezierCurve | BsplineTrajectory | CompositeTrajectory


def polynomials_of(name: str, curve: Polynomials) -> PiecewisePolynomial:
    """Return the same curve. Raises TrajectoryError, with the name, for one of another kind."""
    if isinstance(curve, PiecewisePolynomial):
        return curve
    if isinstance(curve, BezierCurve | BsplineTrajectory):
        curve = CompositeTrajectory((curve,))
    if not isinstance(curve, CompositeTrajectory):
        raise TrajectoryError(
            f"{name} must be polynomials between breaks, not {quoted(curve)}: take"
            " PiecewisePolynomial.cubic_hermite through values and derivatives of it"
        )
    return curve.piecewise_polynomial()
