"""A shortest path from vertices and edges: preprocessing, relaxation, rounding, search."""

from __future__ import annotations

from collections.abc import Sequence
import itertools
from typing import Any

import numpy as np

from scene_graph_ros.geometry.optimization.errors import ConvexSetError, SolverError
from scene_graph_ros.geometry.optimization.graphs.bounds import (
    bound_of_paths,
    Potentials,
    ProvenBound,
)
from scene_graph_ros.geometry.optimization.graphs.edge import Edge, Vertex
from scene_graph_ros.geometry.optimization.graphs.edge_terms import EdgeTerms, terms_of
from scene_graph_ros.geometry.optimization.graphs.network import Network, TwoCycle
from scene_graph_ros.geometry.optimization.graphs.options import GraphOfConvexSetsOptions
from scene_graph_ros.geometry.optimization.graphs.placed_set import PlacedSet
from scene_graph_ros.geometry.optimization.graphs.relaxation import Problem, relax, Relaxed
from scene_graph_ros.geometry.optimization.graphs.restriction import restrict
from scene_graph_ros.geometry.optimization.graphs.result import (
    GraphOfConvexSetsResult,
    PathBound,
)
from scene_graph_ros.geometry.optimization.graphs.rounding import draw_paths, main_path
from scene_graph_ros.geometry.optimization.graphs.search import (
    Incumbent,
    search_paths,
    Searched,
)
from scene_graph_ros.geometry.optimization.sets.point import Point

__all__ = ["network_of", "solve_path", "solve_restriction"]

_ROUNDED_PATHS = 5
"""Paths that are drawn where nothing is said."""


def network_of(
    vertices: Sequence[Vertex], edges: Sequence[Edge], source: Vertex, target: Vertex
) -> Network:
    """Return the edges by the places of their vertices in a list."""
    place = {vertex.id: k for k, vertex in enumerate(vertices)}
    return Network(
        len(vertices),
        np.array([place[e.u.id] for e in edges], dtype=np.int64),
        np.array([place[e.v.id] for e in edges], dtype=np.int64),
        place[source.id],
        place[target.id],
    )


def _terms(edge: Edge, source: Vertex) -> EdgeTerms:
    """Return what an edge and the vertex it leads to cost, and the source where it leads there."""
    parts: list[Vertex | Edge] = [edge, edge.v]
    if edge.u is source:
        parts.append(edge.u)
    costs = [cost for part in parts for cost in part.get_costs()]
    constraints = [c for part in parts for c in part.get_constraints()]
    ends = ((edge.u.id, edge.u.placed), (edge.v.id, edge.v.placed))
    return terms_of(costs, constraints, ends, f"GraphOfConvexSets: edge {edge.name!r}")


def _problem_of(
    vertices: Sequence[Vertex], edges: Sequence[Edge], source: Vertex, target: Vertex
) -> Problem:
    """Return a problem of these edges alone, with costs in units of what a path may cost."""
    network = network_of(vertices, edges, source, target)
    terms = [_terms(edge, source) for edge in edges]
    most = np.array([each.most() for each in terms])
    unit = network.distances(most)[network.target]
    if not 0.0 < unit < np.inf:
        unit = float(most.max(initial=0.0)) or 1.0
    forced = tuple(k for k, edge in enumerate(edges) if True in edge.phi_constraints)
    return Problem(network, [v.placed for v in vertices], terms, forced, float(unit))


def _standing(vertex: Vertex) -> Problem:
    """Return the problem of staying in one vertex: an edge to a point that costs as it does."""
    ends = ((vertex.id, vertex.placed), (-1, PlacedSet.place(Point())))
    label = f"GraphOfConvexSets: vertex {vertex.name!r}"
    terms = terms_of(vertex.get_costs(), vertex.get_constraints(), ends, label)
    most = terms.most()
    network = Network(2, np.array([0]), np.array([1]), 0, 1)
    return Problem(network, [e[1] for e in ends], [terms], (), most or 1.0)


def _no_path(reason: str) -> GraphOfConvexSetsResult:
    return GraphOfConvexSetsResult(False, np.inf, np.inf, reason)


def solve_path(
    vertices: Sequence[Vertex],
    edges: Sequence[Edge],
    source: Vertex,
    target: Vertex,
    options: GraphOfConvexSetsOptions,
) -> GraphOfConvexSetsResult:
    """Return the shortest path, as `GraphOfConvexSets.solve_shortest_path` promises."""
    if source is target:
        return _stay(source, edges)
    forced = [e for e in edges if True in e.phi_constraints]
    used = [e for e in edges if False not in e.phi_constraints]
    lost = next((e for e in forced if False in e.phi_constraints), None)
    if options.preprocessing is not False:
        kept = network_of(vertices, used, source, target).on_simple_paths()
        used = [used[k] for k in kept]
    lost = lost or next((e for e in forced if e not in used), None)
    if lost is not None:
        return _no_path(f"edge {lost.name!r} has to be on the path, but can't be")
    touched = {v.id for e in used for v in (e.u, e.v)} | {source.id, target.id}
    vertices = [v for v in vertices if v.id in touched]
    network = network_of(vertices, used, source, target)
    if not used or network.distances(np.zeros(len(used)))[network.target] == np.inf:
        return _no_path(f"no edges lead from {source.name!r} to {target.name!r}")
    problem = _problem_of(vertices, used, source, target)
    relaxed = relax(problem)
    if relaxed.cost == np.inf:
        return _infeasible(problem, _potentials(relaxed), relaxed)
    proven = bound_of_paths(problem, _potentials(relaxed))
    rounded, count, failure = _round(problem, relaxed, options)
    cycles: set[TwoCycle] = set()
    for _ in range(options.max_tightenings):
        if rounded is not None and _is_closed(proven, rounded, options):
            break
        more = _two_cycles_of(network, relaxed.flows, options) - cycles
        if not more:
            break
        cycles |= more
        tighter = relax(problem, sorted(cycles, key=lambda cycle: (cycle.vertex, cycle.into)))
        if tighter.cost == np.inf:
            return _infeasible(problem, _potentials(tighter), tighter)
        relaxed, before = tighter, proven
        proven = max(
            bound_of_paths(problem, _potentials(relaxed)), before, key=lambda each: each.value
        )
        again, count_again, failure = _round(problem, relaxed, options)
        count += count_again
        if again is not None and (rounded is None or again.best.cost < rounded.best.cost):
            rounded = again
    answer = _Answer(vertices, used, problem, relaxed, proven)
    if options.convex_relaxation:
        return answer.of_relaxation(rounded, count, failure)
    searched = search_paths(
        problem, proven, rounded, options.gap_tolerance, options.max_search_programs
    )
    return answer.of_search(searched, count)


def _potentials(relaxed: Relaxed) -> Potentials:
    return Potentials(
        relaxed.levels,
        relaxed.slopes,
        relaxed.visits,
        relaxed.prizes,
        relaxed.multipliers,
        relaxed.cycles,
    )


def _is_closed(proven: ProvenBound, found: Incumbent, options: GraphOfConvexSetsOptions) -> bool:
    """Tell whether the bound is as near to a path as is asked for."""
    cost = found.best.cost
    return cost - proven.value <= options.gap_tolerance * abs(cost)


def _two_cycles_of(
    network: Network, flows: np.ndarray, options: GraphOfConvexSetsOptions
) -> set[TwoCycle]:
    """Return the cycles of two edges around which there is flow: no others are violated."""
    least = options.flow_tolerance
    return {
        cycle
        for cycle in network.two_cycles()
        if flows[list(cycle.into)].sum() > least and flows[list(cycle.back)].sum() > least
    }


def _infeasible(
    problem: Problem, potentials: Potentials, relaxed: Relaxed
) -> GraphOfConvexSetsResult:
    proof = bound_of_paths(problem, potentials, with_cost=False)
    if proof.value > 0.0:
        return _no_path("no path keeps the constraints of its edges, which is proven")
    raise SolverError(
        "GraphOfConvexSets.solve_shortest_path: the solver found no path that keeps the"
        f" constraints, but its proof does not hold ({proof.value:.3g} must be above 0, residual"
        f" {relaxed.residual:.1e})"
    )


def _round(
    problem: Problem, relaxed: Relaxed, options: GraphOfConvexSetsOptions
) -> tuple[Incumbent | None, int, str]:
    """Return the best of the path with the most flow and of some that are drawn from the flows.

    And how many were tried, and a failure.

    A failure is what the solver said of one of them that it did not solve, else empty.
    """
    given = options.max_rounded_paths
    most = _ROUNDED_PATHS if given is None else given
    main = main_path(problem.network, relaxed.flows, options.flow_tolerance)
    drawn = draw_paths(
        problem.network,
        relaxed.flows,
        most,
        options.max_rounding_trials,
        options.flow_tolerance,
        np.random.default_rng(options.rounding_seed),
    )
    paths = [] if main is None else [main, *(path for path in drawn if path != main)][:most]
    found: Incumbent | None = None
    failure = ""
    for path in paths:
        if not set(problem.forced) <= set(path):
            continue
        try:
            best = restrict(problem, path)
        except SolverError as error:
            failure = str(error)  # of the others one may do; without any the result says so
            continue
        if best.points and (found is None or best.cost < found.best.cost):
            found = Incumbent(path, best)
    return found, len(paths), failure


def _stay(vertex: Vertex, edges: Sequence[Edge]) -> GraphOfConvexSetsResult:
    """Return the path that begins where it ends."""
    forced = next((e for e in edges if True in e.phi_constraints), None)
    if forced is not None:
        return _no_path(f"edge {forced.name!r} has to be on the path, which has none")
    problem = _standing(vertex)
    best = restrict(problem, (0,))
    if not best.points:
        return _no_path(f"vertex {vertex.name!r} can't keep its constraints, which is proven")
    return GraphOfConvexSetsResult(
        True,
        best.cost,
        best.lower_bound,
        "source and target are one vertex",
        vertices=(vertex.id,),
        points=best.points[:1],
        violation=best.violation,
    )


def solve_restriction(
    vertices: Sequence[Vertex], active: Sequence[Edge]
) -> GraphOfConvexSetsResult:
    """Return the best points of a path, as `solve_convex_restriction` promises."""
    label = "GraphOfConvexSets.solve_convex_restriction: active_edges"
    if not active:
        raise ConvexSetError(f"{label} must be the edges of a path, not empty")
    for first, second in itertools.pairwise(active):
        if first.v is not second.u:
            raise ConvexSetError(
                f"{label} must be a path, but {first.name!r} leads to {first.v.name!r} and"
                f" {second.name!r} from {second.u.name!r}"
            )
    visited = [active[0].u, *(e.v for e in active)]
    if len({v.id for v in visited}) < len(visited):
        raise ConvexSetError(f"{label} visit a vertex twice: {[v.name for v in visited]}")
    problem = _problem_of(visited, active, visited[0], visited[-1])
    best = restrict(problem, range(len(active)))
    if not best.points:
        return _no_path("the path can't keep its constraints, which is proven")
    return _with_points(
        visited,
        active,
        Incumbent(tuple(range(len(active))), best),
        {
            "lower_bound": best.lower_bound,
            "reason": "the path was given",
        },
    )


def _with_points(
    vertices: Sequence[Vertex], edges: Sequence[Edge], found: Incumbent, others: dict[str, Any]
) -> GraphOfConvexSetsResult:
    path = [edges[e] for e in found.path]
    visited = [path[0].u, *(e.v for e in path)]
    points = dict(zip((v.id for v in visited), found.best.points, strict=True))
    costs = {e.id: sum(cost.at(points) for cost in e.get_costs()) for e in path}
    return GraphOfConvexSetsResult(
        is_success=True,
        cost=found.best.cost,
        path=tuple(e.id for e in path),
        vertices=tuple(v.id for v in visited),
        points=found.best.points,
        edge_costs=costs,
        violation=found.best.violation,
        **others,
    )


class _Answer:
    """What is told of a relaxation, and of the path that came of it."""

    def __init__(
        self,
        vertices: Sequence[Vertex],
        edges: Sequence[Edge],
        problem: Problem,
        relaxed: Relaxed,
        proven: ProvenBound,
    ) -> None:
        self._vertices, self._edges, self._proven = vertices, edges, proven
        numbers = [e.id for e in edges]
        flows = np.clip(relaxed.flows, 0.0, 1.0)
        centers = [
            (problem.sets[u].center, problem.sets[v].center)
            for u, v in zip(problem.network.tails, problem.network.heads, strict=True)
        ]
        self._common: dict[str, Any] = {
            "flows": dict(zip(numbers, flows.tolist(), strict=True)),
            "phi_xu": {
                number: x + f * c[0]
                for number, x, f, c in zip(numbers, relaxed.points_u, flows, centers, strict=True)
            },
            "phi_xv": {
                number: x + f * c[1]
                for number, x, f, c in zip(numbers, relaxed.points_v, flows, centers, strict=True)
            },
            "relaxation_cost": relaxed.cost,
            "relaxation_bound": PathBound(proven.value, problem, proven.potentials),
            "num_edges_solved": len(edges),
        }

    def of_relaxation(
        self, found: Incumbent | None, count: int, failure: str
    ) -> GraphOfConvexSetsResult:
        """Return the best rounded path with the relaxation's bound."""
        others = {**self._common, "num_rounded_paths": count, "lower_bound": self._proven.value}
        if found is None:
            reason = "no path was drawn: the relaxation alone was solved"
            if failure:
                reason = f"none of {count} rounded paths was solved: {failure}"
            elif count:
                reason = f"none of {count} rounded paths keeps its constraints"
            return GraphOfConvexSetsResult(is_success=False, cost=np.inf, reason=reason, **others)
        others["reason"] = f"the best of {count} rounded paths"
        return _with_points(self._vertices, self._edges, found, others)

    def of_search(self, searched: Searched, count: int) -> GraphOfConvexSetsResult:
        """Return the best path with the search's bound."""
        others = {
            **self._common,
            "num_rounded_paths": count,
            "num_search_programs": searched.num_programs,
            "lower_bound": max(searched.lower_bound, self._proven.value),
        }
        reason = _what_ended(searched)
        if searched.found is None:
            return GraphOfConvexSetsResult(is_success=False, cost=np.inf, reason=reason, **others)
        others["reason"] = reason
        return _with_points(self._vertices, self._edges, searched.found, others)


def _what_ended(searched: Searched) -> str:
    """Return why a search went no further."""
    if searched.found is None:
        if searched.failure:
            return f"no path was found: {searched.failure}"
        if searched.is_complete and searched.lower_bound == np.inf:
            return "no path keeps the constraints of its edges, which is proven"
        return "no path was found within max_search_programs"
    if searched.failure:
        return f"a path that may be better was not solved: {searched.failure}"
    return (
        "the best path, to the tolerance"
        if searched.is_complete
        else "max_search_programs was reached"
    )
