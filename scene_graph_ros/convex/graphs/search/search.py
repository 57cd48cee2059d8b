"""Best-first search of paths with proven bounds: exact, without integer programs.

A* over starts of paths (as in Chia, Jiang, Graesdal, Kaelbling and Tedrake, "GCS*: Forward
heuristic search on implicit graphs of convex sets", 2024). The cost of a start and all its
continuations is bounded by a convex program over its own points, in which the last vertex's
potential takes the place of the rest. Potentials are those of the relaxation, so that little is
searched where it is tight.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import heapq
import itertools

import numpy as np

from scene_graph_ros.convex.errors import SolverError
from scene_graph_ros.convex.graphs.model.options import GraphOfConvexSetsOptions
from scene_graph_ros.convex.graphs.relax.bounds import ProvenBound
from scene_graph_ros.convex.graphs.relax.relaxation import Problem
from scene_graph_ros.convex.graphs.restrict.restriction import (
    bound_of_prefix,
    restrict,
    Restricted,
)
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = ["Incumbent", "Searched", "search_paths"]


_NOTHING = 1e-9
"""Relative to what a path may cost, wherever its points are: a gap that is none."""


@dataclass(frozen=True, eq=False)
class Incumbent:
    """A path, its edges, and its best points."""

    path: tuple[int, ...]
    best: Restricted


@dataclass(frozen=True, eq=False)
class Searched:
    """The best path found, if any, a lower bound of all paths, and the number of programs."""

    found: Incumbent | None
    lower_bound: float
    num_programs: int
    is_complete: bool
    """Whether what is left can't be better than the tolerance asks."""
    failure: str
    """What the solver said of a path that may be better, and was not solved; else empty."""
    is_stopped: bool = False
    """Whether ``termination_func`` ended it."""


def search_paths(
    problem: Problem,
    proven: ProvenBound,
    first: Incumbent | None,
    options: GraphOfConvexSetsOptions,
) -> Searched:
    """Return a path that costs hardly more than the least, by ``gap_tolerance``, and the bound.

    The gap is larger where ``max_search_programs`` is reached, or ``termination_func`` says so.
    """
    return _Search(problem, proven, first, options).run()


@dataclass(frozen=True, eq=False)
class _Start:
    """The first edges of paths; ``value`` bounds their cost and the potential at the end."""

    path: tuple[int, ...]
    value: float
    is_bounded: bool


class _Search:
    def __init__(
        self,
        problem: Problem,
        proven: ProvenBound,
        first: Incumbent | None,
        options: GraphOfConvexSetsOptions,
    ) -> None:
        self._problem, self._proven, self._best = problem, proven, first
        self._tolerance, self._most = options.gap_tolerance, options.max_search_programs
        self._is_over = options.termination_func or (lambda: False)
        self._floor = np.inf if first is None else first.best.lower_bound
        self._count, self._ties = 0, itertools.count()
        self._failed: list[tuple[float, str]] = []
        self._queue: list[tuple[float, int, _Start]] = []
        self._seen = set() if first is None else {first.path}
        target = problem.network.target
        reach, rounding = problem.sets[target].reach(proven.potentials.slopes[target][None])
        self._last = -float(proven.potentials.levels[target] + reach[0] + rounding[0])

    def run(self) -> Searched:
        self._push(self._proven.value, _Start((), -np.inf, True))
        is_stopped = False
        while self._queue and self._count < self._most:
            if self._is_over():
                is_stopped = True
                break
            key, _, start = heapq.heappop(self._queue)
            if key >= self._limit():
                self._floor = min(self._floor, key)
                break
            if start.is_bounded:
                self._expand(key, start)
            else:
                self._bound(key, start)
        floor = min([self._floor, *(key for key, _, _ in self._queue)])
        failure = next((said for key, said in self._failed if key < self._limit()), "")
        is_left = bool(self._queue) and self._queue[0][0] < self._limit()
        is_complete = not is_left and not failure
        return Searched(self._best, floor, self._count, is_complete, failure, is_stopped)

    def _limit(self) -> float:
        """Return from where on a bound is good enough."""
        if self._best is None:
            return np.inf
        return self._best.best.cost * (1.0 - self._tolerance) - _NOTHING * self._problem.unit

    def _push(self, key: float, start: _Start) -> None:
        if key == np.inf:
            return
        if key >= self._limit():
            self._floor = min(self._floor, key)
        else:
            heapq.heappush(self._queue, (key, next(self._ties), start))

    def _vertices(self, path: Sequence[int]) -> list[int]:
        network = self._problem.network
        return [network.source, *(int(network.heads[e]) for e in path)]

    def _rest(self, path: Sequence[int], left: float) -> float:
        """Return a bound of the cost behind a start, less its last potential."""
        behind = self._vertices(path)[:-1]
        visits = self._proven.visits
        forced = [
            prize
            for e, prize in zip(
                self._problem.forced, self._proven.potentials.prizes.tolist(), strict=True
            )
            if e not in path
        ]
        parts = [left, self._last, -float(visits.sum()), float(visits[behind].sum()), -sum(forced)]
        size = float(np.abs(parts[:-1]).sum() + np.abs(forced).sum())
        return sum(parts) - 2.0 * (len(visits) + 8) * EPSILON * size

    def _expand(self, key: float, start: _Start) -> None:
        network = self._problem.network
        visited = set(self._vertices(start.path))
        at = self._vertices(start.path)[-1]
        for e in network.leaving[at]:
            v = int(network.heads[e])
            if v in visited:
                continue
            child = (*start.path, e)
            left = float(self._proven.weights[e] + self._proven.left[v])
            bound = key
            if left == np.inf:
                continue
            if start.path:
                bound = max(bound, start.value + self._rest(start.path, left))
            if v == network.target and not set(self._problem.forced) <= set(child):
                continue
            self._push(bound, _Start(child, start.value, False))

    def _bound(self, key: float, start: _Start) -> None:
        network, potentials = self._problem.network, self._proven.potentials
        v = int(network.heads[start.path[-1]])
        if v == network.target:
            if start.path not in self._seen:
                self._finish(key, start.path)
            return
        self._count += 1
        end = (float(potentials.levels[v]), potentials.slopes[v])
        value = bound_of_prefix(self._problem, start.path, end)
        if value == np.inf:
            return
        bound = max(key, value + self._rest(start.path, float(self._proven.left[v])))
        self._push(bound, _Start(start.path, value, True))

    def _finish(self, key: float, path: tuple[int, ...]) -> None:
        self._count += 1
        try:
            best = restrict(self._problem, path)
        except SolverError as error:
            # Neither points nor a proof: nothing more is known than before.
            self._floor = min(self._floor, key)
            self._failed.append((key, str(error)))
            return
        self._floor = min(self._floor, max(best.lower_bound, key))
        if best.points and (self._best is None or best.cost < self._best.best.cost):
            self._best = Incumbent(path, best)
