"""Proof in floats that two sets meet: differences of their points surround 0.

Points of both sets are known but for rounding, so their differences are, too. Where the hull of
some differences holds a ball about 0 with a radius beyond that rounding, the hull of the true
differences holds 0: support functions differ by no more than the points do. The ball is shown by
a regular simplex about 0 whose corners are convex combinations of differences.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from scene_graph_ros.convex.errors import SolverError
from scene_graph_ros.convex.solve.nearest.nearest_in_hull import nearest_in_hull
from scene_graph_ros.geometry.spatial.sums import length, product
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = ["DRAWN_IN", "ROUNDING", "WELL_CONDITIONED", "drawn_in", "surround"]

DRAWN_IN = 1e-6
"""Of the way to a point of its set: so much a rounded point is moved, half of it to be inside."""

WELL_CONDITIONED = 1e6
"""Ratio of semi-axes up to which those of a form are off by less than a thousandth of that."""

_RADII = (1e-2, 1e-5, 1e-8, 1e-11)
"""Of simplices that are tried, where differences are as far apart as 1 along each axis."""

_MOST_ROUNDS = 200
"""Of differences that are added for one simplex; three dimensions take one to five,
many dimensions of curved sets that overlap by little a hundred."""

ROUNDING = 16.0 * EPSILON
"""Relative to coordinates: what rounding does to a point of a set that is given by numbers."""


def drawn_in(asked: Any, d: np.ndarray) -> tuple[np.ndarray, float] | None:
    """Return a point ``(n,)`` of a bounded set, nearly as far along d as it reaches.

    Behind it is a bound of the rounding in each coordinate. The point is the furthest one, moved
    towards another one; half as far is shown to be enough. None where it isn't.
    """
    start = asked.maybe_get_feasible_point()
    if start is None:
        return None
    way = asked.support(d).point - start
    if not asked._holds((start + (1.0 - 0.5 * DRAWN_IN) * way)[None])[0]:
        return None
    point = start + (1.0 - DRAWN_IN) * way
    size = float(np.abs(start).max(initial=0.0) + np.abs(point).max(initial=0.0))
    return point, ROUNDING * size


def surround(one: Any, other: Any) -> bool:
    """Tell whether two bounded sets are shown to have a point in common by a ball of differences.

    Neither is empty. False leaves it open.
    """
    n = one.ambient_dimension
    if not n:
        return True
    corners = _regular_simplex(n)
    known = _Differences(one, other)
    for d in (*corners, *-corners):
        if known.add(d) is None:
            return False
    if not known.set_units():
        return False
    for radius in _RADII:
        answer = _holds_simplex(known, radius * corners)
        if answer is not None:
            return answer
    return False


class _Differences:
    """The state: differences of points of two sets, and how far rounding moves them."""

    def __init__(self, one: Any, other: Any) -> None:
        self._one, self._other = one, other
        self.points = np.zeros((0, one.ambient_dimension))
        self._units = np.ones(one.ambient_dimension)
        self.rounding = 0.0

    def add(self, d: np.ndarray) -> np.ndarray | None:
        """Add the difference ``(n,)`` furthest along d, and return it; None if it is unknown."""
        try:
            first = self._one._inner_reach(d / self._units)
            second = self._other._inner_reach(-d / self._units)
        except SolverError:  # not known as well as promised how far a curved set reaches
            return None
        if first is None or second is None:
            return None
        found = first[0] - second[0]
        rounding = first[1] + second[1] + EPSILON * float(np.abs(found).max())
        found = found / self._units
        self.rounding = max(self.rounding, rounding / float(self._units.min()))
        self.points = np.concatenate([self.points, found[None]])
        return found

    def set_units(self) -> bool:
        """Measure each axis by how far apart differences are along it; False where they aren't."""
        units = np.ptp(self.points, axis=0)
        if not units.all():
            return False
        self._units, self.points = units, self.points / units
        self.rounding /= float(units.min())
        return True


def _regular_simplex(n: int) -> np.ndarray:
    """Return n + 1 unit vectors ``(n + 1, n)`` whose hull holds the ball of radius 1 / n."""
    root = np.sqrt(n + 1.0)
    corners = np.eye(n) * (root / np.sqrt(n)) - (root - 1.0) * n**-1.5
    return np.concatenate([corners, np.full((1, n), -1.0 / np.sqrt(n))])


def _holds_simplex(known: _Differences, corners: np.ndarray) -> bool | None:
    """Tell whether the hull of differences holds a simplex; None where one may be too large."""
    n = corners.shape[1]
    inner_radius = length(corners[0]) / n
    for _ in range(_MOST_ROUNDS):
        _, weights, failed = nearest_in_hull(known.points, corners)
        if failed >= 0:
            return None
        shares = weights / weights.sum(axis=1)[:, None]
        ways = corners - product(shares, known.points)
        away = np.linalg.norm(ways, axis=1)
        sums = ROUNDING * len(known.points) * float(np.abs(known.points).max())
        lost = np.sqrt(n) * (known.rounding + sums)
        if lost > 0.25 * inner_radius:
            return False
        if away.max() <= 0.5 * inner_radius:
            return True
        for k in np.flatnonzero(away > 0.5 * inner_radius):
            found = known.add(ways[k] / away[k])
            if found is None or float(ways[k] @ (found - corners[k])) < 0.0:
                return None
    return None
