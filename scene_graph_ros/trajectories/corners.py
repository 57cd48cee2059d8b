"""Paths of straight edges whose corners are rounded off."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.trajectories.hermite_segments import hermite_segments, straight_segments_of
from scene_graph_ros.trajectories.piecewise_polynomial import PiecewisePolynomial

__all__ = ["CornerPath", "MovingEnd", "PathPieces"]

Array = NDArray[np.float64]

_SAME = 1e-12
"""Of the whole path: shorter edges, or rests of edges between rounded corners, are none."""

_REVERSAL = -0.99
"""Cosine of 172 degrees: a path that turns back by more is followed to the end, with rest."""

_GENTLE = 0.35
"""About rad: corners that turn less, as those of points along a curve, are rounded to the middles
of both edges, also where these are not equally long."""

_UNEVEN = 1.3
"""Times the shorter edge: up to what the longer edge of such a corner may be."""

_ROUND, _SMOOTH = 3, 7
"""Degrees: of curves whose direction goes on, and of those whose next two derivatives do."""


class MovingEnd(NamedTuple):
    """An end of a path at which a motion does not rest."""

    direction: Array
    """``(k,)``: dq/ds."""
    bend: Array
    """``(k,)``: its derivative."""


class CornerPath:
    """A path of straight edges through configurations ``(n, k)``, and its c corners.

    Lengths along it are measured in ``units`` ``(k,)``: the largest change of an entry by its own
    unit. With largest velocities as units, a length is the least time that an edge takes. Points
    that are no way from the one before, but for rounding, are left out; not so the ends.

    ``through`` ``(n,)`` says which points are passed exactly, without rest. It turns back at a
    corner of 172 degrees or more, which is not rounded. ``start`` and ``end`` are how a motion
    begins and ends that does not rest there.
    """

    def __init__(
        self,
        configurations: Array,
        units: Array,
        *,
        through: NDArray[np.bool_] | None = None,
        start: MovingEnd | None = None,
        end: MovingEnd | None = None,
    ) -> None:
        rows = _apart(configurations, units)
        self.points, self.units = configurations[rows], units
        self.start, self.end = start, end
        ways = np.diff(self.points, axis=0)
        self.lengths = (np.abs(ways) / units).max(axis=1, initial=0.0)
        self.directions = ways / self.lengths[:, np.newaxis]
        exact = np.zeros(len(configurations), dtype=np.bool_) if through is None else through
        self.through = exact[rows[1:-1]]
        unit = self.directions / units
        unit /= np.linalg.norm(unit, axis=1, keepdims=True)
        self.turns_back = (unit[:-1] * unit[1:]).sum(axis=1) < _REVERSAL
        self.turns = np.diff(self.directions, axis=0)

    @property
    def num_corners(self) -> int:
        """How many points are between two edges."""
        return max(len(self.points) - 2, 0)

    def largest_sizes(self, deviation: Array | None = None, *, is_smooth: bool = False) -> Array:
        """Return ``(c, 2)`` how long before and after each corner rounding may begin and end.

        At most half of the shorter of its edges; of gentle corners, half of each. ``deviation``
        ``(k,)`` is how far from the edges each entry may be on the curve of `rounded`.
        """
        halves = 0.5 * np.stack([self.lengths[:-1], self.lengths[1:]], axis=1)
        least = halves.min(axis=1, keepdims=True)
        gentle = (np.abs(self.turns) / self.units).max(axis=1, initial=0.0) < _GENTLE
        gentle &= halves.max(axis=1) <= _UNEVEN * least[:, 0]
        sizes = np.where(gentle[:, np.newaxis], halves, least)
        sizes[self.turns_back] = 0.0
        if deviation is not None:
            # A parabola of size d is d / 4 of the change of direction from its corner, a smooth
            # curve 5/8 of that.
            far = (
                (5.0 / 32.0 if is_smooth else 0.25)
                * sizes.max(axis=1, keepdims=True)
                * np.abs(self.turns)
            )
            uneven = np.where(sizes[:, :1] == sizes[:, 1:], 1.0, 1.5)
            with np.errstate(divide="ignore", invalid="ignore"):
                part = np.where(far > 0.0, deviation / (far * uneven), np.inf).min(axis=1)
            sizes *= np.minimum(part, 1.0)[:, np.newaxis]
        return sizes

    def rounded(self, sizes: Array, *, is_smooth: bool = False) -> PiecewisePolynomial:
        """Return the path q(s) with its corners rounded; one whose size is 0 stays.

        Cubics touch both edges ``sizes`` ``(c, 2)`` away from the corner, along which the path's
        length is the parameter of both; so the direction does not jump. As long before as after
        they are parabolas. A corner that is passed exactly has two.

        Where ``is_smooth``, q'' and q''' go on, too: q'' is 0 along straight edges. Where two
        rounded corners meet in the middle of an edge it is the smaller one of both, if they have
        one sign; so points that are dense on a curve make a curve that bends as evenly.
        """
        return self.pieces(sizes).curve(is_smooth=is_smooth)

    def pieces(self, sizes: Array) -> PathPieces:
        """Return straight edges, or their remainders, and curves around corners, in turn."""
        count, k = len(self.lengths), self.points.shape[1]
        before, after = np.zeros(count), np.zeros(count)  # what corners take off each edge
        after[:-1], before[1:] = sizes[:, 0], sizes[:, 1]
        begins = self.points[:-1] + before[:, np.newaxis] * self.directions
        ends = self.points[1:] - after[:, np.newaxis] * self.directions
        begins[0], ends[-1] = self.points[0], self.points[-1]
        left = self.lengths - before - after
        bends = self._bends(sizes, left)
        # Slots: an edge, what is before its corner, what is after that or around it.
        lengths = np.zeros((count, 3))
        sides = np.zeros((count, 3, 6, k))
        lengths[:, 0] = np.where(left > _SAME * self.lengths.sum(), left, 0.0)
        direction = self.directions
        sides[:, 0] = np.stack([begins, direction, 0 * bends, ends, direction, 0 * bends], axis=1)
        rounded = sizes.max(axis=1, initial=0.0) > 0.0
        lengths[:-1, 2] = np.where(rounded, sizes.sum(axis=1), 0.0)
        one = [ends[:-1], direction[:-1], bends[:-1]]
        other = [begins[1:], direction[1:], bends[1:]]
        sides[:-1, 2] = np.stack(one + other, axis=1)
        exact = np.flatnonzero(self.through & rounded)
        if len(exact):
            size = sizes[exact]
            whole = size.sum(axis=1, keepdims=True)
            mean = (size[:, 1:] * direction[exact] + size[:, :1] * direction[exact + 1]) / whole
            middle = [self.points[exact + 1], mean, 2.0 * self.turns[exact] / whole]
            lengths[exact, 1:] = size
            sides[exact, 1] = np.stack([each[exact] for each in one] + middle, axis=1)
            sides[exact, 2] = np.stack(middle + [each[exact] for each in other], axis=1)
        self._lead(lengths, sides)
        corners = np.full((count, 3), -1)
        corners[:, 1:] = np.arange(count)[:, np.newaxis]
        kept = lengths.ravel() > 0.0
        return PathPieces(
            lengths.ravel()[kept], sides.reshape(-1, 6, k)[kept], corners.ravel()[kept]
        )

    def _bends(self, sizes: Array, left: Array) -> Array:
        """Return q'' ``(e, k)`` in the middle of each edge, where two rounded corners meet."""
        bends = np.zeros_like(self.directions)
        with np.errstate(divide="ignore", invalid="ignore"):
            mean = self.turns / sizes.sum(axis=1, keepdims=True)
        meets = left <= _SAME * self.lengths.sum()
        at = np.flatnonzero(meets[1:-1]) + 1
        at = at[(sizes[at - 1] > 0.0).all(axis=1) & (sizes[at] > 0.0).all(axis=1)]
        at = at[~(self.through[at - 1] | self.through[at])]
        least = np.minimum(np.abs(mean[at - 1]), np.abs(mean[at]))
        bends[at] = np.where(mean[at - 1] * mean[at] > 0.0, np.sign(mean[at]) * least, 0.0)
        return bends

    def _lead(self, lengths: Array, sides: Array) -> None:
        """Have the first and the last edge begin and end as a motion does."""
        if self.start is not None:
            sides[0, 0, 1:3] = self.start
        if self.end is not None:
            sides[-1, 0, 4:6] = self.end


class PathPieces(NamedTuple):
    """The pieces of a path, in turn."""

    lengths: Array
    """``(p,)``."""
    sides: Array
    """``(p, 6, k)``: q, q' and q'' at both ends."""
    corners: NDArray[np.intp]
    """``(p,)``: around which corner, -1 for edges."""

    def curve(self, *, is_smooth: bool) -> PiecewisePolynomial:
        """Return the path; see `CornerPath.rounded`."""
        breaks = np.concatenate([[0.0], self.lengths.cumsum()])
        chosen = np.arange(len(self.lengths))
        return PiecewisePolynomial(breaks, self.control_points(chosen, is_smooth=is_smooth))

    def control_points(self, chosen: NDArray[np.intp], *, is_smooth: bool) -> Array:
        """Return control points ``(m, degree + 1, k)`` of some pieces."""
        degree = _SMOOTH if is_smooth else _ROUND
        lengths, sides = self.lengths[chosen], self.sides[chosen]
        result = hermite_segments(lengths, sides, degree)
        straight = (sides[:, 1] == sides[:, 4]).all(axis=1) & ~sides[:, 2::3].any(axis=(1, 2))
        result[straight] = straight_segments_of(sides[straight, 0], sides[straight, 3], degree)
        return result

    def corner_at(self, s: float) -> int:
        """Return the index of the rounded corner nearest to a parameter s on the path."""
        middles = self.lengths.cumsum() - 0.5 * self.lengths
        away = np.where(self.corners >= 0, np.abs(middles - s), np.inf)
        return int(self.corners[np.argmin(away)])


def _apart(q: Array, units: Array) -> NDArray[np.intp]:
    """Return the indices of a path's points ``(n, k)`` that are apart, and its ends."""
    enough = _SAME * float((np.abs(np.diff(q, axis=0)) / units).max(axis=1, initial=0.0).sum())
    kept = [0]
    for row in range(1, len(q)):
        if float((np.abs(q[row] - q[kept[-1]]) / units).max()) > enough:
            kept.append(row)
    last = len(q) - 1
    if kept[-1] != last and (q[last] != q[kept[-1]]).any():
        # The end replaces what is next to it; a path goes somewhere else before it comes back.
        kept[max(len(kept) - 1, 1) :] = [last]
    return np.array(kept)
