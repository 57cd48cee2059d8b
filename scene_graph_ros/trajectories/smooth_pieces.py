"""Parts of a path between which its direction jumps."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from scene_graph_ros.trajectories.piecewise_polynomial import PiecewisePolynomial

__all__ = ["smooth_pieces"]

_SMOOTH = 1e-9
"""Relative: where a path's direction changes by more at a break, it has a corner."""


def smooth_pieces(path: PiecewisePolynomial) -> list[PiecewisePolynomial]:
    """Return the parts of a path q(s), in turn, inside of which q' goes on."""
    first = path.derivative().control_points
    before, after = first[:-1, -1], first[1:, 0]
    size = np.maximum(np.abs(before), np.abs(after)).max(axis=1, keepdims=True)
    corners = np.flatnonzero((np.abs(after - before) > _SMOOTH * size).any(axis=1)) + 1
    ends = [0, *corners.tolist(), path.num_segments]
    return [
        PiecewisePolynomial(path.breaks[low : high + 1], path.control_points[low:high])
        for low, high in pairwise(ends)
    ]
