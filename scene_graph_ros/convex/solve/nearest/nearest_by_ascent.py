"""The nearest point of a curved set: the direction whose plane is farthest from the goal.

The distance is the largest of ``u . p - h(u)`` over unit vectors u, with the support function h
of the set (Boyd and Vandenberghe, *Convex Optimization*, 2004, section 8.1.3). Where the set is
curved this is as smooth as the set, with the gradient ``p - x(u)``. Then quasi-Newton steps (BFGS;
Nocedal and Wright, *Numerical Optimization*, 2006, chapter 6) converge fast in many dimensions,
where hulls of points of the surface take very many of these.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

__all__ = ["nearest_by_ascent"]

_MOST_STEPS = 200
"""A set of twenty dimensions takes some 50."""

_MOST_HALVINGS = 40

_LEAST_GAIN = 1e-4
"""Share of what the slope promises that a step has to gain (Armijo's condition)."""

_CURVED = 1e-12
"""Of a step and a change of the gradient: less of an angle between them says nothing."""


class _Ascent:
    """The state: the best plane, the nearest point, and how the gradient changes."""

    def __init__(
        self, reach: Callable[[np.ndarray], tuple[float, np.ndarray, float]], p: np.ndarray
    ) -> None:
        self.reach, self.p = reach, p
        self.lower, self.distance, self.x = 0.0, np.inf, p
        self.inverse = np.eye(len(p))
        self.is_scaled = False

    def at(self, u: np.ndarray) -> tuple[float, np.ndarray]:
        """Return the distance of the plane along u from p, and its slope along the sphere."""
        value, x, rounding = self.reach(u)
        plane, way = float(u @ self.p) - value, self.p - x
        self.lower = max(self.lower, plane - rounding)
        distance = float(np.linalg.norm(way))
        if distance < self.distance:
            self.distance, self.x = distance, x
        return plane, way - float(way @ u) * u

    def step(self, u: np.ndarray, slope: np.ndarray) -> np.ndarray:
        """Return a way up along the sphere."""
        way = self.inverse @ slope
        way -= float(way @ u) * u
        if float(way @ slope) > 0.0:
            return way
        self.inverse = np.eye(len(u))
        return slope

    def learn(self, step: np.ndarray, change: np.ndarray) -> None:
        """Take note of how the slope fell along a step: an update of the inverse Hessian."""
        along = float(step @ change)
        if along <= _CURVED * float(np.linalg.norm(step) * np.linalg.norm(change)):
            return
        if not self.is_scaled:
            self.inverse *= along / float(change @ change)
            self.is_scaled = True
        mixed = self.inverse @ change
        self.inverse += (1.0 + float(change @ mixed) / along) / along * np.outer(step, step)
        self.inverse -= (np.outer(mixed, step) + np.outer(step, mixed)) / along


def nearest_by_ascent(
    reach: Callable[[np.ndarray], tuple[float, np.ndarray, float]],
    p: np.ndarray,
    u: np.ndarray,
    enough: float,
) -> tuple[float, np.ndarray, float]:
    """Return the distance of p ``(n,)`` from a set, the nearest point and the gap.

    ``reach`` is as of `nearest_by_support`. The search begins at the unit vector ``u`` and ends
    where the gap is no more than ``enough``, or no step gains any more.
    """
    known = _Ascent(reach, p)
    plane, slope = known.at(u)
    for _ in range(_MOST_STEPS):
        if known.distance - known.lower <= enough:
            break
        way = known.step(u, slope)
        promised, share = float(way @ slope), 1.0
        for _ in range(_MOST_HALVINGS):
            after = u + share * way
            after /= np.linalg.norm(after)
            higher, steeper = known.at(after)
            if higher >= plane + _LEAST_GAIN * share * promised:
                break
            share *= 0.5
        else:
            break
        # Both are carried to where the sphere is now.
        moved, before = after - u, slope
        moved -= float(moved @ after) * after
        before = before - float(before @ after) * after
        known.learn(moved, before - steeper)
        u, plane, slope = after, higher, steeper
    return known.distance, known.x, max(0.0, known.distance - known.lower)
