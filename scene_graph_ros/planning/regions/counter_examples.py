"""Configurations that are not free, looked for along exact gradients of clearances.

Petersen and Tedrake, "Growing convex collision-free regions in configuration space using nonlinear
programming", 2023 (IRIS-NP): from random points a pair of bodies is brought to touch; then the
ellipsoid's distance is minimized while they do. Here both are Newton's method on one pair, whose
distance is linear to first order.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.planning.regions.faces import Cut
from scene_graph_ros.planning.regions.feasibility import Feasibility

__all__ = ["descend", "slide"]

_PAIRS = 3
"""That are tried from a point: those that are the fewest ellipsoids away, to first order."""

_STEPS = 8
"""Of Newton's method until a pair touches; some three are taken."""

_BEYOND = 1e-6
"""Metres that a step aims at below zero, as a pair that only touches is free."""

_STUCK = 1e-9
"""Of a step: where faces leave room for less, it leads out of the region."""

_WORTH = 1e-3
"""Of the distance from the ellipsoid's centre: what a further step must gain."""


def descend(
    feasibility: Feasibility,
    cut: Cut,
    A: NDArray[np.float64],
    b: NDArray[np.float64],
    q: NDArray[np.float64],
    influence: float,
) -> list[NDArray[np.float64]]:
    """Return configurations in ``A x <= b`` that are not free, found from one that is, ``(n,)``.

    Pairs farther than ``influence`` (m) from each other are not tried.
    """
    metric = cut.B @ cut.B.T
    near = feasibility.near(q, influence)
    ways = near.jacobians @ metric
    rates = np.einsum("ij,ij->i", ways, near.jacobians)
    moves = rates > 0.0
    away = np.where(moves, np.abs(near.distances) / np.sqrt(np.where(moves, rates, 1.0)), np.inf)
    found = []
    for k in np.argsort(away, kind="stable")[:_PAIRS]:
        if np.isfinite(away[k]):
            end = _bring_together(feasibility, metric, A, b, q, near.pairs[k], influence)
            if end is not None:
                found.append(end)
    return found


def _bring_together(
    feasibility: Feasibility,
    metric: NDArray[np.float64],
    A: NDArray[np.float64],
    b: NDArray[np.float64],
    start: NDArray[np.float64],
    pair: object,
    influence: float,
) -> NDArray[np.float64] | None:
    """Return the limit of Newton's method for a pair that touches, None without one."""
    q = start
    for _ in range(_STEPS):
        near = feasibility.near(q, influence)
        rows = [k for k, each in enumerate(near.pairs) if each == pair]
        if not rows:
            return None
        distance, slope = float(near.distances[rows[0]]), near.jacobians[rows[0]]
        rate = float(slope @ metric @ slope)
        if distance < 0.0 or not rate > 0.0:
            break
        step = -(distance + _BEYOND) / rate * (metric @ slope)
        rates = A @ step
        room = np.where(rates > 0.0, (b - A @ q) / np.where(rates > 0.0, rates, 1.0), np.inf)
        share = min(1.0, max(0.0, float(room.min(initial=np.inf))))
        if share <= _STUCK:
            break
        q = q + share * step
    is_inside = bool((A @ q <= b).all())
    return q if is_inside and not feasibility.free(q[np.newaxis])[0] else None


def slide(
    feasibility: Feasibility,
    cut: Cut,
    A: NDArray[np.float64],
    b: NDArray[np.float64],
    q: NDArray[np.float64],
    influence: float,
) -> NDArray[np.float64]:
    """Return one in ``A x <= b`` that is not free, nearer to the ellipsoid's centre if possible.

    Newton's method on the pair that is deepest at ``q (n,)``: the nearest point of where its
    distance is zero, to first order; less of the way where that is free.
    """
    metric = cut.B @ cut.B.T
    for _ in range(_STEPS):
        near = feasibility.near(q, influence)
        if not len(near.distances):
            return q
        k = int(np.argmin(near.distances))
        distance, slope = float(near.distances[k]), near.jacobians[k]
        rate = float(slope @ metric @ slope)
        if distance > 0.0 or not rate > 0.0:
            return q
        # The nearest point with slope . x = slope . q - distance - a little.
        goal = float(slope @ (q - cut.center)) - distance - _BEYOND
        nearest = cut.center + goal / rate * (metric @ slope)
        tries = q + np.array([[1.0], [0.5], [0.25]]) * (nearest - q)
        distances = cut.distances(tries)
        # What faces keep out already would be cut off again, and q stay inside.
        better = (tries @ A.T <= b).all(axis=1) & (distances < cut.distances(q[np.newaxis])[0])
        better[better] = ~feasibility.free(tries[better])
        if not better.any():
            return q
        best = int(np.flatnonzero(better)[np.argmin(distances[better])])
        gain = float(cut.distances(q[np.newaxis])[0] - distances[best])
        q = tries[best]
        if gain <= _WORTH * float(distances[best]):
            return q
    return q
