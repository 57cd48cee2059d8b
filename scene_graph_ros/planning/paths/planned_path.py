"""The answer of a planner: a path that is proven, or why there is none."""

from __future__ import annotations

from dataclasses import dataclass
import enum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.planning.plan_failure import PlanFailure

__all__ = ["Plan", "PlanProgress", "PlanStage"]


class PlanStage(enum.Enum):
    """The stage of the work on a plan."""

    CHECKING = 1
    """Start and goals are looked at."""
    SEARCHING = 2
    """Trees grow towards each other."""
    SHORTENING = 3
    """They have met, and shortcuts are tried."""
    PROVING = 4
    """Each edge is proven once more."""
    TIMING = 5
    """A trajectory is made of it, of `plan_trajectory`."""


@one_line()
class PlanProgress(NamedTuple):
    """How far a plan has come."""

    stage: PlanStage
    seconds: float
    """Since it began."""
    tree_sizes: tuple[int, int]
    """How many configurations the trees from start and goals have."""
    edges: int
    """How many edges were looked at."""


@one_line()
@dataclass(frozen=True, eq=False)
class Plan:
    """A path, each of whose edges is proven free, or why there is none.

    ``configurations`` ``(n, nq)`` lead from the start to goal, or target, number ``goal``
    along straight edges (floating joints turn the short way); one where the start is a goal,
    none without success. ``least_clearance`` (m) is a lower bound of all pairs' distances beyond
    their paddings, on all of the way; 0 without success. ``length`` adds up the edges, in rad
    and m. ``failure`` and ``reason`` say why there is no path; both are None where there is
    one. ``tree_sizes`` is how many configurations the trees from start and goals had,
    ``edges`` how many edges were looked at. ``free_from`` is the first configuration from which on
    all is proven free: not the start where that collides and is led out, which is then proven to
    get no deeper; ``least_clearance`` is that of the path from there on.
    """

    configurations: NDArray[np.float64]
    least_clearance: float
    length: float
    goal: int | None
    failure: PlanFailure | None
    reason: str | None
    tree_sizes: tuple[int, int]
    edges: int
    free_from: int = 0

    @property
    def is_success(self) -> bool:
        """Whether there is a path."""
        return self.failure is None

    @property
    def proven(self) -> bool:
        """Whether all edges from ``free_from`` on are proven free: where there is a path."""
        return self.is_success
