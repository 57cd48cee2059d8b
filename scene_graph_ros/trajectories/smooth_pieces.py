"""Parts of a path between which its direction jumps."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.trajectories.piecewise_polynomial import PiecewisePolynomial

__all__ = ["corners_of", "smooth_pieces"]

_SMOOTH = 1e-9
"""Relative: where a path's direction changes by more at a break, it has a corner."""


def corners_of(path: PiecewisePolynomial) -> NDArray[np.intp]:
    """Return the segments of a path q(s) that begin at a corner, where q' jumps; not the first."""
    points = path.control_points
    widths = np.diff(path.breaks)[:, np.newaxis]
    before = (points[:-1, -1] - points[:-1, -2]) / widths[:-1]
    after = (points[1:, 1] - points[1:, 0]) / widths[1:]
    size = np.maximum(np.abs(before), np.abs(after)).max(axis=1, keepdims=True)
    return np.flatnonzero((np.abs(after - before) > _SMOOTH * size).any(axis=1)) + 1


def smooth_pieces(path: PiecewisePolynomial) -> list[PiecewisePolynomial]:
    """Return the parts of a path q(s), in turn, inside of which q' goes on."""
    ends = [0, *corners_of(path).tolist(), path.num_segments]
    if len(ends) == 2:
        return [path]
    return [
        PiecewisePolynomial(path.breaks[low : high + 1], path.control_points[low:high])
        for low, high in pairwise(ends)
    ]
