"""A shortest path from vertices and edges: preprocessing, relaxation, rounding, search."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
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
from scene_graph_ros.geometry.optimization.graphs.expressions import Cost
from scene_graph_ros.geometry.optimization.graphs.functions import (
    FunctionConstraint,
    FunctionCost,
)
from scene_graph_ros.geometry.optimization.graphs.network import Network, TwoCycle
from scene_graph_ros.geometry.optimization.graphs.options import GraphOfConvexSetsOptions
from scene_graph_ros.geometry.optimization.graphs.placed_set import PlacedSet
from scene_graph_ros.geometry.optimization.graphs.relaxation import (
    PlacedFunction,
    Problem,
    relax,
    Relaxed,
)
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
from scene_graph_ros.geometry.optimization.graphs.transcription import Transcription
from scene_graph_ros.geometry.optimization.sets.point import Point

__all__ = ["network_of", "solve_path", "solve_restriction", "terms_of_edge"]

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


def _parts(edge: Edge, source: Vertex) -> list[Vertex | Edge]:
    """Return an edge and the vertex it leads to, and the source where it leads from there."""
    return [edge, edge.v, edge.u] if edge.u is source else [edge, edge.v]


def _is_function(term: Any) -> bool:
    return isinstance(term, FunctionCost | FunctionConstraint)


def terms_of_edge(
    edge: Edge,
    source: Vertex,
    more: Sequence[Cost] = (),
    used: Transcription = Transcription.MIP,
) -> EdgeTerms:
    """Return what an edge and the vertex it leads to cost, and the source where it leads there.

    And ``more`` costs beside them. Of functions nothing is in them.
    """
    parts = _parts(edge, source)
    costs = [c for part in parts for c in part.get_costs(used) if not _is_function(c)]
    constraints = [c for part in parts for c in part.get_constraints(used) if not _is_function(c)]
    ends = ((edge.u.id, edge.u.placed), (edge.v.id, edge.v.placed))
    label = f"GraphOfConvexSets: edge {edge.name!r}"
    return terms_of([*costs, *more], constraints, ends, label)


def _functions(edge: Edge, source: Vertex) -> tuple[PlacedFunction, ...]:
    """Return the functions of an edge and the vertices that count with it."""
    used, found = Transcription.RESTRICTION, []
    for part in _parts(edge, source):
        takes_u, takes_v = part is not edge.v, part is not edge.u
        terms = [*part.get_costs(used), *part.get_constraints(used)]
        found += [PlacedFunction(each, takes_u, takes_v) for each in terms if _is_function(each)]
    return tuple(found)


def _problem_of(
    vertices: Sequence[Vertex],
    edges: Sequence[Edge],
    source: Vertex,
    target: Vertex,
    used: Transcription = Transcription.MIP,
) -> Problem:
    """Return a problem of these edges alone, with costs in units of what a path may cost."""
    network = network_of(vertices, edges, source, target)
    terms = [terms_of_edge(edge, source, (), used) for edge in edges]
    most = np.array([each.most() for each in terms])
    unit = network.distances(most)[network.target]
    if not 0.0 < unit < np.inf:
        unit = float(most.max(initial=0.0)) or 1.0
    forced = tuple(k for k, edge in enumerate(edges) if True in edge.phi_constraints)
    functions = {}
    if used is Transcription.RESTRICTION:
        placed = {k: _functions(edge, source) for k, edge in enumerate(edges)}
        functions = {k: some for k, some in placed.items() if some}
    sets = [v.placed for v in vertices]
    return Problem(network, sets, terms, forced, float(unit), functions)


def _standing(vertex: Vertex, used: Transcription) -> Problem:
    """Return the problem of staying in one vertex: an edge to a point that costs as it does."""
    ends = ((vertex.id, vertex.placed), (-1, PlacedSet.place(Point())))
    label = f"GraphOfConvexSets: vertex {vertex.name!r}"
    costs, constraints = vertex.get_costs(used), vertex.get_constraints(used)
    terms = terms_of(
        [c for c in costs if not _is_function(c)],
        [c for c in constraints if not _is_function(c)],
        ends,
        label,
    )
    functions = tuple(
        PlacedFunction(each, True, False) for each in (*costs, *constraints) if _is_function(each)
    )
    most = terms.most()
    network = Network(2, np.array([0]), np.array([1]), 0, 1)
    sets = [end[1] for end in ends]
    return Problem(network, sets, [terms], (), most or 1.0, {0: functions} if functions else {})


def _used(options: GraphOfConvexSetsOptions) -> tuple[Transcription, Transcription]:
    """Return what the whole graph and what single paths are made of."""
    if options.convex_relaxation:
        return Transcription.RELAXATION, Transcription.RESTRICTION
    return Transcription.MIP, Transcription.MIP


def _has_surrogates(edges: Sequence[Edge]) -> bool:
    """Tell whether a relaxation has what paths need not keep, so that they may cost less."""
    parts = {id(part): part for e in edges for part in (e, e.u, e.v)}
    of = (Transcription.RELAXATION, Transcription.RESTRICTION)
    return any(
        (of[0] in used and of[1] not in used)
        for part in parts.values()
        for used in part.transcriptions
    ) or any(
        isinstance(cost, FunctionCost) for part in parts.values() for cost in part.get_costs(of[1])
    )


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
        return _stay(source, edges, _used(options)[1])
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
    whole, single = _used(options)
    problem = _problem_of(vertices, used, source, target, whole)
    of_paths = problem if whole is single else _problem_of(vertices, used, source, target, single)
    relaxed = relax(problem)
    if relaxed.cost == np.inf:
        return _infeasible(problem, _potentials(relaxed), relaxed)
    proven = bound_of_paths(problem, _potentials(relaxed))
    rounded, count, failure = _round(of_paths, relaxed, options)
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
        again, count_again, failure = _round(of_paths, relaxed, options)
        count += count_again
        if again is not None and (rounded is None or again.best.cost < rounded.best.cost):
            rounded = again
    answer = _Answer(vertices, used, problem, relaxed, proven)
    if options.convex_relaxation:
        found = answer.of_relaxation(rounded, count, failure)
        return replace(found, lower_bound=-np.inf) if _has_surrogates(used) else found
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


def _stay(vertex: Vertex, edges: Sequence[Edge], used: Transcription) -> GraphOfConvexSetsResult:
    """Return the path that begins where it ends."""
    forced = next((e for e in edges if True in e.phi_constraints), None)
    if forced is not None:
        return _no_path(f"edge {forced.name!r} has to be on the path, which has none")
    problem = _standing(vertex, used)
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
    vertices: Sequence[Vertex],
    active: Sequence[Edge],
    guess: Sequence[np.ndarray] | None = None,
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
    used = Transcription.RESTRICTION
    problem = _problem_of(visited, active, visited[0], visited[-1], used)
    best = restrict(problem, range(len(active)), guess)
    if not best.points:
        return _no_path("the path can't keep its constraints, which is proven")
    return _with_points(
        visited,
        active,
        Incumbent(tuple(range(len(active))), best),
        used,
        {
            "lower_bound": best.lower_bound,
            "reason": "the path was given",
        },
    )


def _with_points(
    vertices: Sequence[Vertex],
    edges: Sequence[Edge],
    found: Incumbent,
    used: Transcription,
    others: dict[str, Any],
) -> GraphOfConvexSetsResult:
    path = [edges[e] for e in found.path]
    visited = [path[0].u, *(e.v for e in path)]
    points = dict(zip((v.id for v in visited), found.best.points, strict=True))
    return GraphOfConvexSetsResult(
        is_success=True,
        cost=found.best.cost,
        path=tuple(e.id for e in path),
        vertices=tuple(v.id for v in visited),
        points=found.best.points,
        edge_costs={e.id: e.costs_at(points, used) for e in path},
        vertex_costs={v.id: v.costs_at(points, used) for v in visited},
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
        return _with_points(self._vertices, self._edges, found, Transcription.RESTRICTION, others)

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
        return _with_points(self._vertices, self._edges, searched.found, Transcription.MIP, others)


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
