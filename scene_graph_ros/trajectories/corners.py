"""Paths of straight edges whose corners are rounded off."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.trajectories.piecewise_polynomial import PiecewisePolynomial

__all__ = ["CornerPath"]

_SAME = 1e-12
"""Of the whole path: shorter edges, or rests of edges between rounded corners, are none."""


class CornerPath:
    """A path of straight edges through configurations ``(n, k)``, and its corners.

    Lengths along it are measured in ``units`` ``(k,)``: the largest change of an entry by its own
    unit. With largest velocities as units, a length is the least time that an edge takes. Points
    that are no way from the one before, but for rounding, are left out; not so the ends.
    """

    def __init__(self, configurations: NDArray[np.float64], units: NDArray[np.float64]) -> None:
        self.points = _apart(configurations, units)
        ways = np.diff(self.points, axis=0)
        self.lengths = (np.abs(ways) / units).max(axis=1, initial=0.0)
        self.directions = ways / self.lengths[:, np.newaxis]

    @property
    def num_corners(self) -> int:
        """How many points are between two edges."""
        return max(len(self.points) - 2, 0)

    def largest_sizes(self) -> NDArray[np.float64]:
        """Return ``(c,)`` how long before and after each corner rounding may begin and end.

        At most half of the shorter of its edges.
        """
        return 0.5 * np.minimum(self.lengths[:-1], self.lengths[1:])

    def rounded_corners(self, sizes: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the control points ``(c, 3, k)`` of parabolas in the place of all corners.

        They touch both edges ``sizes`` ``(c,)`` away from the corner, along which the path's
        length is the parameter of both; so the direction does not jump.
        """
        corners, size = self.points[1:-1], sizes[:, np.newaxis]
        before = corners - size * self.directions[:-1]
        after = corners + size * self.directions[1:]
        return np.stack([before, corners, after], axis=1)

    def rounded(self, sizes: NDArray[np.float64]) -> PiecewisePolynomial:
        """Return the path q(s) with its corners rounded; one whose size is 0 stays."""
        parabolas = self.rounded_corners(sizes)
        cut = np.concatenate([[0.0], sizes, [0.0]])
        enough = _SAME * float(self.lengths.sum())
        breaks, control = [0.0], []
        here = self.points[0]
        for edge, length in enumerate(self.lengths):
            straight = length - cut[edge] - cut[edge + 1]
            is_last = edge == len(self.lengths) - 1
            there = self.points[-1] if is_last else parabolas[edge, 0]
            if straight > enough:
                control.append(np.stack([here, 0.5 * (here + there), there]))
                breaks.append(breaks[-1] + straight)
            if not is_last:
                here = parabolas[edge, 2]
                if sizes[edge] > 0.0:
                    control.append(parabolas[edge])
                    breaks.append(breaks[-1] + 2.0 * sizes[edge])
        return PiecewisePolynomial(np.array(breaks), np.array(control))

    def corner_at(self, sizes: NDArray[np.float64], s: float) -> int:
        """Return which rounded corner is nearest to a place s on that path."""
        ends = self.lengths.cumsum()[:-1] - sizes
        # A corner of size d is 2 d long, which is what it takes off its edges: s counts the same.
        away = np.where(sizes > 0.0, np.abs(ends + sizes - s), np.inf)
        return int(np.argmin(away))


def _apart(q: NDArray[np.float64], units: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the points of a path ``(n, k)`` that are apart, and its ends."""
    enough = _SAME * float((np.abs(np.diff(q, axis=0)) / units).max(axis=1, initial=0.0).sum())
    kept = [0]
    for row in range(1, len(q)):
        if float((np.abs(q[row] - q[kept[-1]]) / units).max()) > enough:
            kept.append(row)
    last = len(q) - 1
    if kept[-1] != last and (q[last] != q[kept[-1]]).any():
        # The end replaces what is next to it; a path goes somewhere else before it comes back.
        kept[max(len(kept) - 1, 1) :] = [last]
    return q[kept]
