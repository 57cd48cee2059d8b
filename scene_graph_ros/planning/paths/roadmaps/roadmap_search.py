"""One search for a path through a roadmap, in place of one by two trees."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.planning.paths.roadmaps.roadmap import Roadmap
from scene_graph_ros.planning.paths.search.path_search import PathSearch, SearchTask

__all__ = ["RoadmapSearch"]

_MOST_NODES = 2**13
"""Of a roadmap: more configurations are not drawn."""


class RoadmapSearch(PathSearch):
    """A search from one start to one of several goals; the same for the same seed and roadmap.

    ``tree_sizes`` are the configurations that start and goals may be joined to.
    """

    def __init__(self, task: SearchTask, roadmap: Roadmap | None = None) -> None:
        super().__init__(task)
        self._roadmap = Roadmap() if roadmap is None else roadmap
        self._roadmap.prepare(task.plan, task.space, task.seed)
        self._edges_before = self._roadmap.edges
        self._parts, self._apart = (0, 0), math.inf

    @property
    def tree_sizes(self) -> tuple[int, int]:
        """How many configurations start and goals may be joined to."""
        return self._parts

    @property
    def edges(self) -> int:
        """How many edges were looked at."""
        return super().edges + self._roadmap.edges - self._edges_before

    @property
    def gap(self) -> float:
        """How near (rad and m) these came to each other; infinite where nobody has looked."""
        return self._apart

    def find(
        self, start: NDArray[np.float64], goals: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], int] | None:
        """Return a path ``(n, nq)`` and the row of its goal; None when stopped, or out of room."""
        roadmap, stop, rules = self._roadmap, self._task.stop, self._task.rules
        first = int(roadmap.add(start[np.newaxis])[0])
        last = roadmap.add(goals)
        roadmap.join(first, last)
        while stop[0] == 0:
            way = roadmap.shortest(first, last)
            if way is None:
                self._note_parts(first, last)
                if not roadmap.grow(_MOST_NODES, stop, rules):
                    break
            elif roadmap.is_proven(way, stop, rules):
                self._note_parts(first, last)
                return self._task.space.settled(roadmap.path(way)), int(np.argmax(last == way[-1]))
        parts = self._note_parts(first, last)
        self._apart = roadmap.gap(*parts, int(last[0]))
        return None

    def _note_parts(
        self, first: int, last: NDArray[np.int64]
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        parts = self._roadmap.parts(first, last)
        self._parts = len(parts[0]), len(parts[1])
        return parts
