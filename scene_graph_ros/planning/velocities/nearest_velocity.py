"""The velocity of a box nearest to one that is asked for, while distances change fast enough."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.convex.solve.nearest.projection import project_points

__all__ = ["NearestVelocity", "least_loss", "nearest_velocity"]

_ACTIVE = 1e-9
"""Of multipliers: smaller ones are rounding."""

_WEIGHT = 1e4
"""Of the rate that is lost, against the velocities."""

_LOOSE = 1e-9
"""m/s: the slack for rounding where the rate that is lost is known."""


class NearestVelocity(NamedTuple):
    """A velocity, and the rows that hold it."""

    velocity: NDArray[np.float64]
    active: NDArray[np.intp]
    """Rows that hold it."""


def nearest_velocity(
    asked: NDArray[np.float64],
    low: NDArray[np.float64],
    high: NDArray[np.float64],
    G: NDArray[np.float64],
    rates: NDArray[np.float64],
) -> NearestVelocity | None:
    """Return the velocity v in a box ``(n,)`` nearest to one asked, with ``G v >= rates``.

    None where no velocity is. ``G (k, n)``. The method is that of Goldfarb and Idnani, see
    ``project_points``.
    """
    inside = np.minimum(np.maximum(asked, low), high)
    if (G @ inside >= rates).all():
        return NearestVelocity(inside, np.empty(0, np.intp))
    rows = np.flatnonzero(np.minimum(G * low, G * high).sum(axis=1) < rates)
    n = len(asked)
    A = np.concatenate([np.eye(n), -np.eye(n), -G[rows]])
    b = np.concatenate([high, -low, -rates[rows]])
    found, multipliers, failed = project_points(A, b, 0, asked[np.newaxis])
    if failed >= 0:
        return None
    velocity = np.minimum(np.maximum(found[0], low), high)
    return NearestVelocity(velocity, rows[multipliers[0, 2 * n :] > _ACTIVE])


def least_loss(
    asked: NDArray[np.float64],
    box: tuple[NDArray[np.float64], NDArray[np.float64]],
    G: NDArray[np.float64],
    rates: NDArray[np.float64],
    is_soft: NDArray[np.bool_],
) -> NearestVelocity | None:
    """Return the velocity that misses soft rates by least, nearest to the one asked among these.

    All other rows hold; None where they can't.
    """
    n = len(asked)
    low, high = box
    wide = np.concatenate([G, np.where(is_soft, 1.0 / _WEIGHT, 0.0)[:, np.newaxis]], axis=1)
    most = _WEIGHT * (np.abs(rates).max(initial=0.0) + float((np.abs(G) @ _speeds(box)).max()))
    first = nearest_velocity(
        np.append(np.minimum(np.maximum(asked, low), high), 0.0),
        np.append(low, 0.0),
        np.append(high, most),
        wide,
        rates,
    )
    if first is None:
        return None
    lost = float(np.where(is_soft, rates - G @ first.velocity[:n], 0.0).max())
    relaxed = rates - np.where(is_soft, max(lost, 0.0) + _LOOSE, 0.0)
    return nearest_velocity(asked, low, high, G, relaxed) or NearestVelocity(
        first.velocity[:n], first.active
    )


def _speeds(box: tuple[NDArray[np.float64], NDArray[np.float64]]) -> NDArray[np.float64]:
    """Return the largest speeds of a box ``(n,)``."""
    return np.maximum(np.abs(box[0]), np.abs(box[1]))
