"""A shortest path from vertices and edges: preprocessing, relaxation, rounding, search."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from scene_graph_ros.convex.errors import SolverError
from scene_graph_ros.convex.graphs.expressions.transcription import Transcription
from scene_graph_ros.convex.graphs.model.edge import Edge, Vertex
from scene_graph_ros.convex.graphs.model.options import GraphOfConvexSetsOptions
from scene_graph_ros.convex.graphs.network.flow_programs import on_disjoint_ways
from scene_graph_ros.convex.graphs.network.network import Network, TwoCycle
from scene_graph_ros.convex.graphs.relax.bounds import (
    bound_of_relaxation,
    ProvenBound,
)
from scene_graph_ros.convex.graphs.relax.mixed_integer import solve_mixed_integer
from scene_graph_ros.convex.graphs.relax.relaxation import (
    Relaxed,
)
from scene_graph_ros.convex.graphs.restrict.restriction import restrict
from scene_graph_ros.convex.graphs.search.few_paths import best_of_few
from scene_graph_ros.convex.graphs.search.given_path import stay
from scene_graph_ros.convex.graphs.search.path_answer import (
    ended_early,
    no_path,
    no_path_in_time,
    PathAnswer,
)
from scene_graph_ros.convex.graphs.search.path_problem import (
    free_problem,
    network_of,
    problem_of,
)
from scene_graph_ros.convex.graphs.search.result import (
    GraphOfConvexSetsResult,
)
from scene_graph_ros.convex.graphs.search.rounded_paths import (
    begun,
    better,
    has_surrogates,
    in_time,
    is_closed,
    round_paths,
    rounded_path,
    Stop,
    Tried,
)
from scene_graph_ros.convex.graphs.search.search import (
    Incumbent,
    search_paths,
)
from scene_graph_ros.convex.graphs.search.unbounded import Places, solve_in_boxes

__all__ = ["solve_path"]

_EXACT, _ROUGH = 1e-10, 1e-4
"""What the relaxation's solver is asked for, at best and where a path's gap may be large."""

_MANY = 0.5
"""Of all cycles of two edges: where flow goes around more of them, all are constrained at once."""


def _used(options: GraphOfConvexSetsOptions) -> tuple[Transcription, Transcription]:
    """Return the transcriptions of the whole graph and of single paths."""
    if options.convex_relaxation:
        return Transcription.RELAXATION, Transcription.RESTRICTION
    return Transcription.MIP, Transcription.MIP


def solve_path(
    vertices: Sequence[Vertex],
    edges: Sequence[Edge],
    network: Network,
    options: GraphOfConvexSetsOptions,
) -> GraphOfConvexSetsResult:
    """Return the shortest path, as `GraphOfConvexSets.solve_shortest_path` promises.

    ``network`` has the places of vertices and edges.
    """
    source, target = vertices[network.source], vertices[network.target]
    if source is target:
        return stay(source, edges, _used(options)[1], options.of_restriction)
    kept = _usable(vertices, edges, network, options)
    if isinstance(kept, GraphOfConvexSetsResult):
        return kept
    network, touched = network.take(kept).without_others()
    vertices, used = [vertices[k] for k in touched.tolist()], [edges[k] for k in kept.tolist()]
    if all(vertex.is_bounded for vertex in vertices):
        found = best_of_few(vertices, used, network, options)
        if found is not None:
            return found
        return _solve(vertices, used, network, options, _used(options), None)
    rough = replace(options, max_tightenings=0, max_rounded_paths=None, convex_relaxation=None)
    if options.mixed_integer is not None:
        rough = replace(rough, solver=None, solver_options=None)
    rough = replace(rough, convex_relaxation=True)

    def solve(
        some: Sequence[Vertex], of: Sequence[Edge], places: Places, is_any: bool
    ) -> GraphOfConvexSetsResult:
        left = network_of(some, of, source, target)
        if not _leads(left):
            return no_path("no edges lead on within the boxes around unbounded sets")
        chosen = rough if is_any else options
        return _solve(some, of, left, chosen, _used(options), places)

    return solve_in_boxes(vertices, used, (source, target), frozenset(_used(options)), solve)


def _usable(
    vertices: Sequence[Vertex],
    edges: Sequence[Edge],
    network: Network,
    options: GraphOfConvexSetsOptions,
) -> np.ndarray | GraphOfConvexSetsResult:
    """Return the numbers of edges ``(k,)`` that may be on a path, or that there is none."""
    asked = [(k, e.phi_constraints) for k, e in enumerate(edges) if e.has_phi_constraints]
    is_kept = np.ones(len(edges), dtype=bool)
    is_kept[[k for k, phi in asked if False in phi]] = False
    kept = np.flatnonzero(is_kept)
    if options.preprocessing is not False:
        kept = kept[network.take(kept).on_simple_paths()]
        if options.of_preprocessing is not None and len(kept):
            kept = kept[on_disjoint_ways(network.take(kept), options.of_preprocessing)]
    left = set(kept.tolist())
    lost = next((k for k, phi in asked if True in phi and k not in left), None)
    if lost is not None:
        return no_path(f"edge {edges[lost].name!r} has to be on the path, but can't be")
    # Of simple paths' edges each is on a way to the target.
    is_sure = options.preprocessing is not False and options.of_preprocessing is None
    if not len(kept) or not (is_sure or _leads(network.take(kept))):
        ends = vertices[network.source], vertices[network.target]
        return no_path(f"no edges lead from {ends[0].name!r} to {ends[1].name!r}")
    return kept


def _leads(network: Network) -> bool:
    m = len(network.tails)
    return m > 0 and network.distances(np.zeros(m))[network.target] < np.inf


def _solve(
    vertices: Sequence[Vertex],
    used: Sequence[Edge],
    within: Network,
    options: GraphOfConvexSetsOptions,
    transcriptions: tuple[Transcription, Transcription],
    places: Places | None,
) -> GraphOfConvexSetsResult:
    """Return the shortest path along edges that lead to the target, of bounded sets.

    ``within`` has the places of vertices and edges; ``transcriptions`` are those of the whole
    graph and of single paths; ``places`` are sets in place of the vertices' own.
    """
    whole, single = transcriptions
    problem = problem_of(vertices, used, within, whole, None, places)
    of_paths = problem_of(vertices, used, within, single, (problem, whole), places)
    is_over = Stop(options.termination_func)
    asked = None if options.termination_func is None else is_over
    problem = replace(problem, solver=options.continuous, is_over=asked)
    of_paths = replace(of_paths, solver=options.of_restriction, is_over=asked)
    network = problem.network
    tried: Tried = {}
    is_surrogate = bool(options.convex_relaxation) and has_surrogates(used)
    tolerance = _EXACT
    if not options.convex_relaxation:
        # What is lost of the bound, which is proven whatever the solver says, is of this size.
        tolerance = min(max(options.gap_tolerance**2, _EXACT), _ROUGH)
    least = max(options.flow_tolerance, 10.0 * tolerance)
    of_bound = vertices[within.source], used, of_paths, places, options.continuous
    free = free_problem(*of_bound) if is_surrogate else problem
    start = begun((problem, free), tolerance)
    if start is None:
        return no_path_in_time()
    problem, relaxed = start
    proven = bound_of_relaxation(problem, relaxed)
    if relaxed.cost == np.inf:
        return _infeasible(proven, relaxed)
    first: Incumbent | None = None
    cycles: set[TwoCycle] = set()
    ordered: list[TwoCycle] = []
    for _ in range(options.max_tightenings if options.mixed_integer is None else 0):
        # Around no others a constraint is violated.
        more = set(network.two_cycles(relaxed.flows, least)) - cycles
        if not more or is_over():
            break
        # Of flows that go there and back one path says enough: others will be drawn.
        bound = None if is_surrogate else proven
        limit = np.inf if first is None else first.best.cost
        main, _, _ = round_paths(of_paths, relaxed, bound, options, tried, 1, limit)
        first = better(first, main)
        if first is not None and is_closed(bound, first, options):
            break
        cycles |= more
        everywhere = network.two_cycles()
        if len(cycles) > _MANY * len(everywhere):
            # Flows would turn to the others next.
            cycles = set(everywhere)
        ordered = sorted(cycles, key=lambda cycle: (cycle.vertex, cycle.into))
        again = in_time(problem, ordered, tolerance)
        if again is None:
            break  # The flows and the bound before are good.
        relaxed = again
        tighter = bound_of_relaxation(problem, relaxed)
        if relaxed.cost == np.inf:
            return _infeasible(tighter, relaxed)
        proven = max(tighter, proven, key=lambda each: each.value)
    rounded, count, failure, bound = rounded_path(
        (of_paths, free), (relaxed, proven), (ordered, tolerance), used, options, tried, first
    )
    answer = PathAnswer(used, problem, relaxed, (free, bound))
    if options.convex_relaxation:
        found = answer.of_relaxation(rounded, count, failure, tried)
        return ended_early(found) if is_over.has_stopped else found
    if options.mixed_integer is not None:
        path, said = solve_mixed_integer(problem, options.mixed_integer)
        exact = None if path is None else Incumbent(path, restrict(of_paths, path))
        exact = exact if exact is not None and exact.best.points else None
        return answer.of_mixed_integer(options.mixed_integer.name, exact, said)
    searched = search_paths(problem, proven, rounded, options)
    return answer.of_search(searched, count)


def _infeasible(proof: ProvenBound, relaxed: Relaxed) -> GraphOfConvexSetsResult:
    if proof.value > 0.0:
        return no_path("no path keeps the constraints of its edges, which is proven")
    raise SolverError(
        "GraphOfConvexSets.solve_shortest_path: the solver found no path that keeps the"
        f" constraints, but its proof does not hold ({proof.value:.3g} must be above 0, residual"
        f" {relaxed.residual:.1e})"
    )
