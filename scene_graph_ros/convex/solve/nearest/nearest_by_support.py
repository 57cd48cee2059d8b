"""The nearest point of a set that is known by how far it reaches: Wolfe's method (1976).

The nearest point of the hull of points found so far is sought, then the point of the set furthest
on the way from there to the goal is added. On polytopes it ends after finitely many points, on
others it converges; the plane through the furthest point bounds the error.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from scene_graph_ros.convex.solve.nearest.nearest_by_ascent import nearest_by_ascent
from scene_graph_ros.convex.solve.nearest.nearest_in_hull import nearest_in_hull
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = ["nearest_by_support"]

_MOST_POINTS = 400
"""Points of the set that are asked for; smooth sets in three dimensions take some 20 to 60."""

_MOST_IDLE = 30
"""Points in a row that made the bound no better, after which rounding is what is left."""

_GAP = 1e-13
"""Relative to the numbers in play: where the search ends."""

_SHORT = 1e-11
"""The same: a larger gap is not what is left by rounding."""


def nearest_by_support(
    reach: Callable[[np.ndarray], tuple[float, np.ndarray, float]],
    p: np.ndarray,
    apart: float = np.inf,
) -> tuple[float, np.ndarray, float]:
    """Return the distance of p ``(n,)`` from a bounded set, the nearest point and the gap.

    ``reach(direction)`` is the set's support, the point, and a bound of the value's shortfall.
    The search ends, too, where the distance is surely more than ``apart``, relative to the
    numbers in play.
    """
    direction = np.where(p != 0.0, p, 1.0)
    _, first, _ = reach(direction / np.linalg.norm(direction))
    points = first[None]
    best, idle = (np.inf, first, np.inf), 0
    for _ in range(_MOST_POINTS):
        nearest, weights, _ = nearest_in_hull(points, p[None])
        x, points = nearest[0], points[weights[0] > 0.0]
        way = p - x
        distance = float(np.linalg.norm(way))
        size = float(np.abs(p).max(initial=0.0) + np.abs(points).max(initial=0.0))
        if distance <= 16.0 * EPSILON * size:
            return 0.0, p.copy(), 0.0
        value, furthest, rounding = reach(way / distance)
        gap = max(0.0, value + rounding - float(x @ way) / distance)
        idle += 1
        if min(gap, distance) < best[2]:
            best, idle = (distance, x, min(gap, distance)), 0
        is_known = (points == furthest).all(axis=1).any()
        if distance - gap > apart * size:
            return distance, x, gap
        if gap <= _GAP * size or is_known or idle > _MOST_IDLE:
            break
        points = np.concatenate([points, furthest[None]])
    size = float(np.abs(p).max(initial=0.0) + np.abs(points).max(initial=0.0))
    if best[2] > _SHORT * size:
        # Of curved sets in many dimensions planes say more than points of the surface.
        ways = p - best[1]
        found = nearest_by_ascent(reach, p, ways / np.linalg.norm(ways), _GAP * size)
        best = min(best, found, key=lambda each: each[2])
    return best
