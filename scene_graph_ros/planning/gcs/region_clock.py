"""The time limit of a plan through regions, and its watch function."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
import math
import time

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.convex.graphs.model.options import GraphOfConvexSetsOptions
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.reals import as_float
from scene_graph_ros.planning.paths.path_planner import PATIENCE
from scene_graph_ros.planning.paths.planned_path import PlanProgress
from scene_graph_ros.planning.regions.errors import RegionNotFoundError

__all__ = ["RegionClock"]


class RegionClock:
    """Tells whether it is late; without a timeout and a watch function it changes nothing."""

    def __init__(self, timeout: float | None, watch: Callable[[], None] | None) -> None:
        """Begin, and call ``watch`` once. Raises ConvexSetError for a bad timeout."""
        patience = None if timeout is None else as_float(timeout)
        if timeout is not None and (patience is None or not 0.0 <= patience < math.inf):
            raise ConvexSetError(
                "plan_through_regions: timeout must be seconds from 0 on, or None, not"
                f" {quoted(timeout)}"
            )
        self._begin, self._patience, self._watch = time.monotonic(), patience, watch
        if watch is not None:
            watch()

    @property
    def words(self) -> str:
        """The time that there is, in words."""
        return f"within {self._patience or 0.0:.10g} s"

    @property
    def left(self) -> float:
        """Seconds that a path may be looked for."""
        if self._patience is None:
            return PATIENCE
        return max(self._patience - (time.monotonic() - self._begin), 0.0)

    @property
    def is_set(self) -> bool:
        """Whether there is a time, or anyone to call."""
        return self._patience is not None or self._watch is not None

    def follow(self, progress: PlanProgress) -> None:
        """Call the watch function during a search for a path."""
        if self._watch is not None:
            self._watch()

    def is_late(self) -> bool:
        """Tell whether the time is over; calls the watch function, which may raise."""
        if self._watch is not None:
            self._watch()
        return self._patience is not None and self.left == 0.0

    def growing(self, q: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return that configurations keep all constraints. Raises RegionNotFoundError if late."""
        if self.is_late():
            raise RegionNotFoundError(f"plan_through_regions: no regions grew {self.words}")
        return np.zeros((len(q), 1))

    def in_time(self, options: GraphOfConvexSetsOptions | None) -> GraphOfConvexSetsOptions | None:
        """Return options of a search that ends in time, where there is one."""
        if not self.is_set:
            return options
        given = options or GraphOfConvexSetsOptions()
        own = given.termination_func
        return replace(
            given, termination_func=lambda: self.is_late() or (own is not None and own())
        )
