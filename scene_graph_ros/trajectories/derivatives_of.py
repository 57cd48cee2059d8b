"""Values and derivatives of a curve at many places at once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.trajectories.curve_kernels import write_derivatives
from scene_graph_ros.trajectories.piecewise_polynomial import PiecewisePolynomial

__all__ = ["LEAST_DEGREE", "derivatives_of"]

LEAST_DEGREE = 3
"""Of curves whose derivatives are written."""


def derivatives_of(curve: PiecewisePolynomial, s: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a curve's values and three derivatives ``(4, m, n)`` at places ``(m,)`` on it."""
    if curve.degree < LEAST_DEGREE:
        curve = curve.elevate_degree(LEAST_DEGREE)
    out = np.empty((4, len(s), curve.rows))
    write_derivatives(curve.breaks, curve.control_points, np.ascontiguousarray(s), out)
    return out
