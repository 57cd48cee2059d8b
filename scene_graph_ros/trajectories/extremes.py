"""The largest values of curves at all times: proven bounds, not samples."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.trajectories.extremes_kernels import largest_of_rows
from scene_graph_ros.trajectories.piecewise_polynomial import PiecewisePolynomial

__all__ = ["Peak", "largest_ratios"]


class Peak(NamedTuple):
    """The largest of a curve's entries, each in units of a limit of its own."""

    bounds: NDArray[np.float64]
    """``(n,)``: what each entry's ratio is nowhere above: proven."""
    times: NDArray[np.float64]
    """``(n,)``: where it is so large, to 1e-12 of it or of the limit."""


def largest_ratios(
    curve: PiecewisePolynomial, lower: NDArray[np.float64], upper: NDArray[np.float64]
) -> Peak:
    """Return the largest ratios of a curve's entries to limits ``(n,)``, at all times.

    The ratio of a value is that to its upper limit, or to its lower one: above 1 it is beyond one
    of them. ``lower`` is negative and ``upper`` positive. A segment's values are in the hull of
    its control points; segments that may hold the largest are cut in halves until that is known.
    """
    n = curve.rows
    best, bounds, times = (np.empty(n) for _ in range(3))
    sides = np.array(lower), np.array(upper)  # writable, as one kernel is compiled for one kind
    largest_of_rows(curve.breaks, curve.control_points, *sides, best, bounds, times)
    return Peak(bounds, times)
