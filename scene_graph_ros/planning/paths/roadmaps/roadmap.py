"""A roadmap that proves its edges when a path needs them, and remembers the outcome.

Lazy PRM (Bohlin and Kavraki, *Path Planning Using Lazy PRM*, 2000): random free configurations are
joined to their nearest ones; the shortest way through them is proven edge by edge, and those edges
that are not free are left out, until a way is proven or more configurations are needed. With the
number of neighbours of Karaman and Frazzoli (*Sampling-based Algorithms for Optimal Motion
Planning*, 2011, section 3.3, k-PRM*) ways become as short as can be with more configurations.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
import math

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components, dijkstra

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.planning.edges.edge_proofs import prove
from scene_graph_ros.planning.edges.edge_stretches import EdgeRules, FREE
from scene_graph_ros.planning.errors import PlanningError
from scene_graph_ros.planning.pairs.checker_plan import CheckerPlan
from scene_graph_ros.planning.paths.search.position_space import PositionSpace

__all__ = ["Roadmap"]

_FIRST = 64
"""Random configurations that a roadmap begins with."""

_GROWTH = 0.5
"""Of its configurations: so many are drawn when there is no way left."""

_COMPARED = 256
"""Configurations whose distances are worked out where there is no way."""

_UNKNOWN, _PROVEN, _REFUSED = range(3)


@one_line("num_configurations", "num_proven_edges")
class Roadmap:
    """Free configurations, and edges between them of which some are proven.

    One that is given to `plan_path` again knows its earlier proofs. Where the checker has
    changed meanwhile, all is proven anew as it is needed. Positions that do not move must stay as
    they were. One search uses it at a time. `build_roadmap` makes one whose edges are proven
    beforehand.
    """

    def __init__(self) -> None:
        self._plan: CheckerPlan | None = None
        self._space: PositionSpace | None = None
        self._rng = np.random.default_rng(0)
        self._nodes = np.empty((0, 0))
        self._ends = np.empty((0, 2), dtype=np.int64)
        """``(e, 2)``: the later configuration first."""
        self._rows: dict[tuple[int, int], int] = {}
        self._lengths = np.empty(0)
        self._states = np.empty(0, dtype=np.int8)
        self.edges = 0
        """How many edges were looked at."""

    @property
    def num_configurations(self) -> int:
        """How many configurations it has."""
        return len(self._nodes)

    @property
    def num_proven_edges(self) -> int:
        """How many of its edges are proven free, for the checker that was used last."""
        return int((self._states == _PROVEN).sum())

    @property
    def configurations(self) -> NDArray[np.float64]:
        """Its configurations ``(n, nq)``."""
        return self._nodes.copy()

    def prepare(self, plan: CheckerPlan, space: PositionSpace, seed: int) -> None:
        """Get ready for a search; proofs for another plan are forgotten.

        Raises PlanningError where other positions stay as they are, or elsewhere.
        """
        if self._space is None:
            self._rng = np.random.default_rng(seed)
            self._nodes = np.empty((0, plan.tree.num_positions))
        elif not _same_held(self._space, space):
            raise PlanningError(
                "the roadmap was made with other positions held, or held elsewhere: use a new one"
            )
        if self._plan is not plan:
            self._states[:] = _UNKNOWN
        self._plan, self._space = plan, space

    def add(
        self, q: NDArray[np.float64], look: Callable[[], None] = lambda: None
    ) -> NDArray[np.int64]:
        """Add configurations ``(n, nq)`` and edges to their neighbours; return their rows.

        ``look`` is called before each of them; after an exception of it the roadmap is of no use.
        """
        space, rows = self._needed(), np.arange(len(self._nodes), len(self._nodes) + len(q))
        if not len(q):
            return rows
        self._nodes = np.concatenate([self._nodes, q])
        count, moving = len(self._nodes), int((space.lower < space.upper).sum())
        dimensions = max(1, moving + 3 * len(space.quaternions))
        wanted = math.ceil(math.e * (1.0 + 1.0 / dimensions) * math.log(max(count, 2)))
        ends, lengths = [], []
        for row in rows:
            look()
            far = space.distances(self._nodes[row], self._nodes[:row])
            near = np.argsort(far, kind="stable")[:wanted]
            ends.append(np.stack([np.full(len(near), row), near], axis=1))
            lengths.append(far[near])
        self._append(np.concatenate(ends), np.concatenate(lengths))
        return rows

    def join(self, a: int, others: NDArray[np.int64]) -> None:
        """Add edges from a configuration to others, where there are none."""
        for b in map(int, others):
            ends = max(a, b), min(a, b)
            if ends not in self._rows:
                far = self._needed().distances(self._nodes[a], self._nodes[[b]])
                self._append(np.array([ends]), far)

    def grow(self, most: int, stop: NDArray[np.int64], rules: EdgeRules) -> bool:
        """Add random free configurations; tell whether there is room for any."""
        plan = self._needed_plan()
        count = min(max(_FIRST, int(_GROWTH * len(self._nodes))), most - len(self._nodes))
        if count <= 0:
            return False
        drawn = self.draw(count)
        points = np.repeat(drawn[:, np.newaxis], 2, axis=1)
        free = prove(plan, points, rules._replace(part=1.0), stop=stop).statuses == FREE
        if free.any():
            self.add(drawn[free])
        return True

    def edge_table(self) -> tuple[NDArray[np.int64], NDArray[np.bool_], NDArray[np.bool_]]:
        """Return rows of configurations ``(e, 2)`` at edges; which are proven; which are not free.

        Of others nothing is known.
        """
        return self._ends.copy(), self._states == _PROVEN, self._states == _REFUSED

    def draw(self, count: int) -> NDArray[np.float64]:
        """Return random configurations ``(count, nq)``."""
        return self._needed().samples(self._rng, count)

    def unknown(self) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
        """Return the rows of edges nothing is known of, and these edges ``(n, 2, nq)``."""
        rows = np.flatnonzero(self._states == _UNKNOWN)
        return rows, self._straight(rows)

    def note(self, rows: NDArray[np.intp], is_free: NDArray[np.bool_]) -> None:
        """Remember of some edges whether they are proven free."""
        self._states[rows] = np.where(is_free, _PROVEN, _REFUSED)
        self.edges += len(rows)

    def shortest(self, start: int, goals: NDArray[np.int64]) -> list[int] | None:
        """Return the rows of the shortest way to a goal that may be free, or None."""
        graph = self._graph()
        lengths, before = dijkstra(graph, directed=False, indices=start, return_predecessors=True)
        goal = int(goals[np.argmin(lengths[goals])])
        if not math.isfinite(lengths[goal]):
            return None
        way = [goal]
        while way[-1] != start:
            way.append(int(before[way[-1]]))
        return way[::-1]

    def is_proven(self, way: list[int], stop: NDArray[np.int64], rules: EdgeRules) -> bool:
        """Prove the unknown edges of a path; tell whether all are free."""
        plan, edges = self._needed_plan(), self._edges_of(way)
        new = edges[self._states[edges] == _UNKNOWN]
        if len(new):
            proofs = prove(plan, self._straight(new), rules, stop=stop)
            if stop[0] != 0:
                return False
            self.note(new, proofs.statuses == FREE)
        return bool((self._states[edges] == _PROVEN).all())

    def path(self, way: list[int]) -> NDArray[np.float64]:
        """Return the configurations ``(n, nq)`` of a way, with all turns counted."""
        space, path = self._needed(), [self._nodes[way[0]]]
        for row in way[1:]:
            path.append(self._nodes[row] + space.turns(path[-1], self._nodes[row]))
        return np.array(path)

    def parts(
        self, start: int, goals: NDArray[np.int64]
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return the rows of nodes that start and goals may still be joined to."""
        _, parts = connected_components(self._graph(), directed=False)
        return (
            np.flatnonzero(parts == parts[start]),
            np.flatnonzero(np.isin(parts, parts[goals])),
        )

    def gap(self, first: NDArray[np.int64], second: NDArray[np.int64], goal: int) -> float:
        """Return the distance of two of its parts, of the first those that are near a goal."""
        space = self._needed()
        near = np.argsort(space.distances(self._nodes[goal], self._nodes[first]), kind="stable")
        rows, others = first[near[:_COMPARED]], self._nodes[second]
        return min(float(space.distances(self._nodes[row], others).min()) for row in rows)

    def _graph(self) -> csr_array:
        is_open = self._states != _REFUSED
        a, b = self._ends[is_open].T
        # Edges of no length are ways, too; a zero would be none.
        lengths = np.maximum(self._lengths[is_open], np.finfo(float).tiny)
        return csr_array((lengths, (a, b)), shape=(len(self._nodes), len(self._nodes)))

    def _edges_of(self, way: list[int]) -> NDArray[np.int64]:
        return np.array([self._rows[max(a, b), min(a, b)] for a, b in pairwise(way)])

    def _straight(self, rows: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return edges ``(n, 2, nq)`` as they are proven, the short way round."""
        space, first, second = self._needed(), *self._nodes[self._ends[rows].T]
        return np.stack([first, second + space.turns(first, second)], axis=1)

    def _append(self, ends: NDArray[np.int64], lengths: NDArray[np.float64]) -> None:
        first = len(self._ends)
        self._rows.update({(int(a), int(b)): first + k for k, (a, b) in enumerate(ends)})
        self._ends = np.concatenate([self._ends, ends])
        self._lengths = np.concatenate([self._lengths, lengths])
        new = np.full(len(ends), _UNKNOWN, dtype=np.int8)
        self._states = np.concatenate([self._states, new])

    def _needed(self) -> PositionSpace:
        assert self._space is not None, "prepare comes first"
        return self._space

    def _needed_plan(self) -> CheckerPlan:
        assert self._plan is not None, "prepare comes first"
        return self._plan


def _same_held(a: PositionSpace, b: PositionSpace) -> bool:
    """Tell whether the same positions stay as they are, at the same values."""
    held = a.least == a.most
    return bool((held == (b.least == b.most)).all() and (a.least[held] == b.least[held]).all())
