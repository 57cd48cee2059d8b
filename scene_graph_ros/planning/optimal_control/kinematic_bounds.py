"""Bounds of a curve's derivatives, measured on the result by its control points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.trajectories.bspline_trajectory import BsplineTrajectory

__all__ = ["DerivativeBound", "largest_excess", "stretch_to_hold"]

_MOST_STRETCH = 1e-5
"""Relative: what a duration may be made longer by to hold bounds exactly."""

_SPARE = 1.001
"""Times what is needed, so that rounding does not leave a bound exceeded once more."""


@dataclass(frozen=True, eq=False)
class DerivativeBound:
    """``lower <= q^(order)(t) <= upper`` at all times, ``(n,)``."""

    label: str
    order: int
    lower: NDArray[np.float64]
    upper: NDArray[np.float64]

    def excess(self, curve: BsplineTrajectory) -> float:
        """Return the excess of control points, in units of the bound, or 1 where it is 0."""
        points = curve.derivative(self.order).control_points
        worst = 0.0
        for bound, beyond in (
            (self.upper, points - self.upper),
            (self.lower, self.lower - points),
        ):
            some = np.isfinite(bound)
            sizes = np.where(bound == 0.0, 1.0, abs(bound))[some]
            worst = max(worst, float((beyond[:, some] / sizes).max(initial=0.0)))
        return worst


def largest_excess(
    bounds: list[DerivativeBound], curve: BsplineTrajectory
) -> tuple[float, DerivativeBound | None]:
    """Return the largest excess and whose it is."""
    excesses = [bound.excess(curve) for bound in bounds]
    if not excesses or max(excesses) == 0.0:
        return 0.0, None
    k = int(np.argmax(excesses))
    return excesses[k], bounds[k]


def stretch_to_hold(
    bounds: list[DerivativeBound], curve: BsplineTrajectory, longest: float
) -> BsplineTrajectory:
    """Return the curve a little slower, if that holds bounds that a solver left by rounding.

    Derivatives of order k fall by the k-th power. Nothing is done where that takes more than 1e-5
    of the time, or makes it longer than ``longest``.
    """
    needed = max((b.excess(curve) for b in bounds if b.order), default=0.0)
    factor = 1.0 + needed * _SPARE
    if needed == 0.0 or needed > _MOST_STRETCH or curve.duration * factor > longest:
        return curve
    return curve.scale_time(factor)
