"""Which points of a path say where it leads, and which ones only repeat that, but for rounding."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.trajectories.waypoint_kernels import keep_far_points

__all__ = ["rounding_of", "telling_points"]

Array = NDArray[np.float64]

_ROUNDING = 3e-7
"""Of the largest entry of a position: some roundings to float32, and arithmetic after them."""

_EXACT = 1e-15
"""Of the largest entry: what rounding of doubles leaves between a point and an edge."""

_DECIMALS = range(3, 8)
"""How many decimals points may have been rounded to; with more they are as good as float32."""

_MOST = 1e-3
"""Of a path's extent: what is larger is no rounding."""

_WHOLE = 1e-6
"""A number times a power of ten that is so near to a whole number is one."""


def rounding_of(points: Array, units: Array) -> Array:
    """Return ``(k,)`` how far rounding may have moved the points ``(n, k)`` of a path, at most.

    That is as of float32, or as of the fewest decimals that all of a position's values have; at
    most 1e-3 of the path's extent in its ``units`` ``(k,)``.
    """
    result = _ROUNDING * np.abs(points).max(axis=0)
    for decimals in reversed(_DECIMALS):
        scaled = points * 10.0**decimals
        whole = (np.abs(scaled - np.rint(scaled)) < _WHOLE).all(axis=0) & (len(points) > 2)
        result = np.where(whole, np.maximum(result, 10.0**-decimals), result)
    extent = float((np.ptp(points, axis=0) / units).max())
    least: Array = np.minimum(result, _MOST * extent * units)
    return least


def telling_points(
    points: Array, tolerance: Array, always: NDArray[np.bool_] | None = None
) -> NDArray[np.intp]:
    """Return the indices of points ``(n, k)`` of a path to keep: its ends, and some ``always``.

    All others are within ``tolerance`` ``(k,)`` of the straight edges between these (Ramer, *An
    Iterative Procedure for the Polygonal Approximation of Plane Curves*, 1972).
    """
    kept = np.zeros(len(points), dtype=np.bool_) if always is None else always.copy()
    kept[[0, -1]] = True
    # A tolerance of 0 keeps all but what is on an edge, as far as doubles tell.
    scale = 1.0 / np.maximum(tolerance, _EXACT * (np.abs(points).max(axis=0) + 1.0))
    keep_far_points(np.ascontiguousarray(points), scale, kept)
    return np.flatnonzero(kept)
