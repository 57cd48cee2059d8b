"""How a motion along a path begins and ends."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.trajectories.corners import MovingEnd

__all__ = ["AT_REST", "EndRates", "MotionEnds", "moving_end"]

Array = NDArray[np.float64]

_ALONG = 1e-9
"""Relative: a velocity that is so near to the direction of an edge is along it."""


class EndRates(NamedTuple):
    """A velocity and an acceleration ``(k,)`` at an end of a motion."""

    velocity: Array
    acceleration: Array

    @property
    def is_rest(self) -> bool:
        """Whether both are 0."""
        return not (self.velocity.any() or self.acceleration.any())


class MotionEnds(NamedTuple):
    """Speeds ds/dt along a path at both ends of a motion, and their derivatives."""

    start: tuple[float, float] = (0.0, 0.0)
    end: tuple[float, float] = (0.0, 0.0)
    rates: tuple[EndRates, EndRates] | None = None
    """The velocities and accelerations that belong to them; None where both are at rest."""

    @property
    def is_rest(self) -> bool:
        """Whether it rests at both ends."""
        return self.rates is None


AT_REST = MotionEnds()
"""From rest to rest."""


def moving_end(
    rates: EndRates, edge: Array, units: Array, side: float
) -> tuple[MovingEnd | None, tuple[float, float]]:
    """Return the direction in which a path begins or ends, and the speed, with its derivative.

    ``edge`` ``(k,)`` is the direction of its first or last edge, of length 1 in ``units``; there
    ``side`` is 1 at the start, and -1 at the end.
    """
    v, a = rates
    if rates.is_rest:
        return None, (0.0, 0.0)
    speed = float((np.abs(v) / units).max())
    if speed == 0.0:
        # It begins along its acceleration, and ends against it.
        size = float((np.abs(a) / units).max())
        return MovingEnd(side * a / size, np.zeros_like(a)), (0.0, side * size)
    direction = v / speed
    if (np.abs(direction - edge) <= _ALONG * units).all():
        direction = edge
    # The entry that is fastest has none of the bend.
    row = int(np.argmax(np.abs(direction) / units))
    change = float(a[row] / direction[row])
    bend = (a - change * direction) / speed**2
    bend[np.abs(bend) * speed**2 <= _ALONG * np.abs(a).max()] = 0.0
    return MovingEnd(direction, bend), (speed, change)
