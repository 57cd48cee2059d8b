"""The answer to a motion of the tool along a way: how far it leads, and why it ends."""

from __future__ import annotations

from dataclasses import dataclass
import enum

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.planning.timing.timing_problem import TimedPath

__all__ = ["StraightFailure", "StraightPlan"]


class StraightFailure(enum.Enum):
    """Why a motion ends before its way does."""

    JOINT_LIMIT = 1
    """A joint is at its limit."""
    OUT_OF_REACH = 2
    """No configuration near by has the tool on the way."""
    TOO_FAST = 3
    """A joint would have to go far while the tool hardly moves: it is beside a singularity."""
    COLLIDES = 4
    """The next edge is not proven free."""
    START = 5
    """The start collides, or is beyond limits."""
    TIMEOUT = 6
    """It was not done in time."""
    TIMING = 7
    """It is all there, but was not timed."""
    CONSTRAINT = 8
    """The next edge is not proven to hold a constraint."""
    START_VIOLATES_CONSTRAINT = 9
    """The start violates a constraint."""


@one_line()
@dataclass(frozen=True, eq=False)
class StraightPlan:
    """Configurations that lead a tool along a way, as far as it goes.

    ``configurations`` ``(n, nq)`` begin with the start; along the straight edges between them the
    tool's origin is certainly within ``deviation`` (m) of its way, and its orientation within
    ``rotation_deviation`` (rad); at configurations it is on it, to 1e-9. All edges are proven
    free, and all pairs certainly keep ``least_clearance`` (m) beyond their paddings. ``fractions``
    ``(n,)`` are the shares of the way up to each, ``fraction`` is the last of them. ``failure``
    and ``reason`` say why that is not 1, or why there is no trajectory. ``timed`` is the
    trajectory along that part, where limits were given.
    """

    configurations: NDArray[np.float64]
    fractions: NDArray[np.float64]
    deviation: float
    rotation_deviation: float
    least_clearance: float
    failure: StraightFailure | None
    reason: str | None
    timed: TimedPath | None

    @property
    def fraction(self) -> float:
        """The share of the way that it leads along, from 0 to 1."""
        return float(self.fractions[-1]) if len(self.fractions) else 0.0

    @property
    def is_success(self) -> bool:
        """Whether it leads to the end, and is timed if it was to be."""
        return self.failure is None
