"""The answer of a filter of velocities: the velocity, the pairs that hold it, and its proof."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.model.paths import GeometryPair
from scene_graph_ros.geometry.one_line import one_line

__all__ = ["DistantPair", "SafeStep"]


@one_line()
class DistantPair(NamedTuple):
    """Two geometries, and how far they are apart now."""

    pair: GeometryPair
    """With names."""
    distance: float
    """Metres beyond their padding."""


@one_line("is_kept", "proven_until", "velocity", "active")
@dataclass(frozen=True, eq=False)
class SafeStep:
    """A velocity for the next step of a robot.

    ``velocity`` ``(nv,)``, rad/s and m/s, is the one nearest to that asked for whose step, and
    braking after it, keeps all pairs that a joint moves at their distance: that ``is_kept``. Else
    it is the one that loses least of it, as far as limits and all else allow, and in the end that
    of a robot that brakes. ``active`` are the pairs that hold it back, ``nearest`` is the one with
    the least distance among those that were looked at, None where all are farther than any motion
    can lead. ``proven_until`` (s from now) is how long the velocity may be held for braking from
    then on to be free: a step where it is kept, else 0. ``brake_time`` (s) is how long braking
    then takes.
    """

    velocity: NDArray[np.float64]
    active: tuple[DistantPair, ...]
    is_kept: bool
    proven_until: float
    nearest: DistantPair | None
    brake_time: float
