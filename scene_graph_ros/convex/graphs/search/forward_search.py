"""Best-first search of paths forward from the source, with a proven gap.

As in Chia, Jiang, Graesdal, Kaelbling and Tedrake, "GCS*: Forward heuristic search on implicit
graphs of convex sets", 2024, but that pruned paths count in the bound, where they compare the
points reached. The cost of a start of a path and all its continuations is bounded by a convex
program over the start's points with the heuristic at its end.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
import heapq
import itertools
from typing import Any, NamedTuple

import numpy as np

from scene_graph_ros.convex.errors import ConvexSetError, SolverError
from scene_graph_ros.convex.graphs.expressions.expressions import as_cost, Cost
from scene_graph_ros.convex.graphs.expressions.transcription import Transcription
from scene_graph_ros.convex.graphs.model.edge import Edge, Vertex
from scene_graph_ros.convex.graphs.model.edge_terms import EdgeTerms
from scene_graph_ros.convex.graphs.model.options import GraphOfConvexSetsOptions
from scene_graph_ros.convex.graphs.relax.edge_table import EdgeTable
from scene_graph_ros.convex.graphs.relax.relaxation import Problem
from scene_graph_ros.convex.graphs.restrict.chain import Chain
from scene_graph_ros.convex.graphs.restrict.restriction import (
    best_of_chain,
    bound_of_prefix,
    restrict,
    Restricted,
)
from scene_graph_ros.convex.graphs.search.given_path import stay
from scene_graph_ros.convex.graphs.search.path_answer import costs_at
from scene_graph_ros.convex.graphs.search.path_problem import network_of, terms_of_edge
from scene_graph_ros.convex.graphs.search.result import GraphOfConvexSetsResult

__all__ = ["ForwardSearch"]

Path = tuple[Edge, ...]


class _Found(NamedTuple):
    path: Path
    best: Restricted


class ForwardSearch:
    """One search, see `ImplicitGraphOfConvexSets.solve_shortest_path`."""

    def __init__(
        self,
        successors: Callable[[Vertex], list[Edge]],
        source: Vertex,
        is_target: Callable[[Vertex], bool],
        options: GraphOfConvexSetsOptions,
        heuristic: Callable[[Vertex], Any] | None,
        most_calls: int,
        most_paths: int | None,
    ) -> None:
        if options.mixed_integer is not None:
            raise ConvexSetError(
                f"ImplicitGraphOfConvexSets.solve_shortest_path: solver {options.solver!r} takes a"
                " whole graph; expand it, and ask gcs"
            )
        self._successors, self._source, self._is_target = successors, source, is_target
        self._options, self._heuristic = options, heuristic
        self._most_calls, self._most_paths = most_calls, most_paths
        self._terms: dict[int, EdgeTerms] = {}
        self._ahead: dict[int, Cost | None] = {}
        self._expanded: set[int] = set()
        self._through: Counter[int] = Counter()
        self._queue: list[tuple[float, int, bool, Path]] = []
        self._ties = itertools.count()
        self._found: _Found | None = None
        self._floor, self._programs, self._failure = np.inf, 0, ""

    def run(self) -> GraphOfConvexSetsResult:
        """Search until the gap is closed or a limit is reached."""
        if self._is_target(self._source):
            return stay(self._source, [], Transcription.MIP, self._options.of_restriction)
        self._push(0.0, True, ())
        reason = "all paths were looked at"
        while self._queue:
            if self._queue[0][0] >= self._limit():
                reason = "the best path, to the tolerance"
                break
            if self._programs >= self._options.max_search_programs:
                reason = "max_search_programs was reached"
                break
            is_over = self._options.termination_func
            if is_over is not None and is_over():
                reason = "termination_func ended the search"
                break
            key, _, is_bounded, path = heapq.heappop(self._queue)
            if not is_bounded:
                self._bound(key, path)
            elif not self._expand(key, path):
                self._push(key, True, path)
                reason = "max_successor_calls was reached"
                break
        return self._result(reason)

    def _limit(self) -> float:
        """Return from where on a bound is good enough."""
        if self._found is None:
            return np.inf
        return self._found.best.cost * (1.0 - self._options.gap_tolerance)

    def _push(self, key: float, is_bounded: bool, path: Path) -> None:
        heapq.heappush(self._queue, (key, next(self._ties), is_bounded, path))

    def _expand(self, key: float, path: Path) -> bool:
        """Put all that follow a start in the queue; False where no more may be asked for."""
        at = path[-1].v if path else self._source
        if at.id >= 0 and at.id not in self._expanded:  # others are of slack variables
            if len(self._expanded) >= self._most_calls:
                return False
            self._expanded.add(at.id)
        visited = {self._source.id, *(e.v.id for e in path)}
        for edge in self._successors(at):
            if edge.v.id not in visited and False not in edge.phi_constraints:
                self._push(key, False, (*path, edge))
        return True

    def _bound(self, key: float, path: Path) -> None:
        at = path[-1].v
        self._programs += 1
        if self._is_target(at):
            self._finish(key, path)
            return
        value = self._least(path, self._cost_ahead(at))
        if value == np.inf:
            return
        key = max(key, value)
        if self._most_paths is not None and self._through[at.id] >= self._most_paths:
            self._floor = min(self._floor, key)
            return
        self._through[at.id] += 1
        self._push(key, True, path)

    def _finish(self, key: float, path: Path) -> None:
        try:
            best = self._best(path)
        except SolverError as error:
            self._floor, self._failure = min(self._floor, key), str(error)
            return
        self._floor = min(self._floor, max(key, best.lower_bound))
        if best.points and (self._found is None or best.cost < self._found.best.cost):
            self._found = _Found(path, best)

    def _cost_ahead(self, v: Vertex) -> Cost | None:
        """Return the heuristic's cost of a vertex."""
        if self._heuristic is None:
            return None
        if v.id not in self._ahead:
            cost = as_cost(self._heuristic(v), f"heuristic of {v.name!r}")
            for part in (cost.rest, *(atom.of for atom in cost.atoms)):
                if {*part.terms} - {v.id}:
                    raise ConvexSetError(
                        f"heuristic of {v.name!r}: only its own vertex.x may be in the expression"
                    )
            self._ahead[v.id] = cost
        return self._ahead[v.id]

    def _least(self, path: Path, ahead: Cost | None) -> float:
        """Return a lower bound of a start's cost, with its heuristic at its end."""
        terms = self._terms_of(path, ahead)
        chained = None if self._options.of_restriction else self._chain(path, terms).solve()
        if chained is not None:
            return chained.bound
        end = (0.0, np.zeros(path[-1].v.ambient_dimension))
        return bound_of_prefix(self._problem(path, terms), range(len(path)), end)

    def _best(self, path: Path) -> Restricted:
        terms = self._terms_of(path, None)
        chain = None if self._options.of_restriction else self._chain(path, terms)
        best = None if chain is None else best_of_chain(chain)
        return best or restrict(self._problem(path, terms), range(len(path)))

    def _terms_of(self, path: Path, ahead: Cost | None) -> list[EdgeTerms]:
        """Return the terms of edges, with those of the heuristic at the end."""
        for edge in path:
            if edge.id not in self._terms:
                self._terms[edge.id] = terms_of_edge(edge, self._source)
        terms = [self._terms[edge.id] for edge in path]
        if ahead is not None:
            terms[-1] = terms_of_edge(path[-1], self._source, (ahead,))
        return terms

    def _chain(self, path: Path, terms: Sequence[EdgeTerms]) -> Chain:
        return Chain(terms, [self._source.placed, *(e.v.placed for e in path)])

    def _problem(self, path: Path, terms: Sequence[EdgeTerms]) -> Problem:
        vertices = [self._source, *(e.v for e in path)]
        network = network_of(vertices, path, vertices[0], vertices[-1])
        table = EdgeTable(terms)
        unit = float(table.costs_at_most().sum()) or 1.0
        sets, solver = [v.placed for v in vertices], self._options.of_restriction
        return Problem(network, sets, table, (), unit, solver=solver)

    def _result(self, reason: str) -> GraphOfConvexSetsResult:
        floor = min([self._floor, *(key for key, *_ in self._queue)])
        others = {"lower_bound": floor, "num_search_programs": self._programs}
        found = self._found
        if found is None:
            if self._failure:
                reason = f"no path was found: {self._failure}"
            elif floor == np.inf:
                reason = "no path keeps the constraints of its edges, or none leads there"
            elif not self._queue:
                reason = "no path was found through the starts that max_paths_per_vertex left"
            return GraphOfConvexSetsResult(False, np.inf, reason=reason, **others)  # type: ignore[arg-type]
        vertices = [self._source, *(e.v for e in found.path)]
        points = dict(zip((v.id for v in vertices), found.best.points, strict=True))
        return GraphOfConvexSetsResult(
            True,
            found.best.cost,
            min(floor, found.best.cost),
            reason,
            path=tuple(e.id for e in found.path),
            vertices=tuple(v.id for v in vertices),
            points=found.best.points,
            edge_costs=costs_at(found.path, points, Transcription.MIP),
            vertex_costs=costs_at(vertices, points, Transcription.MIP),
            violation=found.best.violation,
            num_search_programs=self._programs,
            num_edges_solved=sum(number >= 0 for number in self._terms),
        )
