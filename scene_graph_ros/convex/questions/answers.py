"""Answers of sets: records of supports and of nearest points."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from scene_graph_ros.geometry.one_line import one_line

__all__ = ["Projection", "Support", "gaps_of"]


@one_line()
class Support(NamedTuple):
    """How far a set reaches along a direction: ``value = max direction . x``, at ``point (n,)``.

    Infinite where it does not end; ``point`` is then the way that it goes, of any length. ``gap``
    bounds the value's shortfall.
    """

    value: float
    point: np.ndarray
    gap: float


@one_line()
class Projection(NamedTuple):
    """The nearest points ``(m, n)`` of a set, how far they are ``(m,)``, and the gaps ``(m,)``.

    A gap is the difference to a lower bound: no point is nearer than the plane through the
    nearest point, square to the way there, moved back to where the set does not cross it.
    """

    distances: np.ndarray
    points: np.ndarray
    gaps: np.ndarray


def gaps_of(
    points: np.ndarray, nearest: np.ndarray, reach: Callable[[np.ndarray, int], float]
) -> tuple[np.ndarray, np.ndarray]:
    """Return distances ``(m,)`` to nearest points, and how much nearer others could be ``(m,)``.

    ``reach(direction, k)`` is how far the set reaches along a unit vector beyond nearest point k.
    """
    ways = points - nearest
    distances = np.linalg.norm(ways, axis=1)
    gaps = np.zeros(len(points))
    for k in np.flatnonzero(distances > 0.0):
        gaps[k] = min(distances[k], max(0.0, reach(ways[k] / distances[k], int(k))))
    return distances, gaps
