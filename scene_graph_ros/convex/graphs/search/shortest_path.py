"""A shortest path from vertices and edges: preprocessing, relaxation, rounding, search."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
import itertools

import numpy as np

from scene_graph_ros.convex.errors import SolverError, StoppedError
from scene_graph_ros.convex.graphs.expressions.functions import (
    FunctionCost,
)
from scene_graph_ros.convex.graphs.expressions.transcription import Transcription
from scene_graph_ros.convex.graphs.model.edge import Edge, Vertex
from scene_graph_ros.convex.graphs.model.options import GraphOfConvexSetsOptions
from scene_graph_ros.convex.graphs.network.flow_programs import on_disjoint_ways
from scene_graph_ros.convex.graphs.network.network import Network, TwoCycle
from scene_graph_ros.convex.graphs.network.rounding import draw_paths, main_path
from scene_graph_ros.convex.graphs.relax.bounds import (
    bound_of_relaxation,
    ProvenBound,
)
from scene_graph_ros.convex.graphs.relax.mixed_integer import solve_mixed_integer
from scene_graph_ros.convex.graphs.relax.relaxation import (
    Problem,
    relax,
    Relaxed,
)
from scene_graph_ros.convex.graphs.restrict.restriction import restrict, Restricted
from scene_graph_ros.convex.graphs.search.few_paths import best_of_few
from scene_graph_ros.convex.graphs.search.given_path import stay
from scene_graph_ros.convex.graphs.search.path_answer import (
    ended_early,
    no_path,
    no_path_in_time,
    PathAnswer,
)
from scene_graph_ros.convex.graphs.search.path_problem import (
    network_of,
    problem_of,
)
from scene_graph_ros.convex.graphs.search.result import (
    GraphOfConvexSetsResult,
)
from scene_graph_ros.convex.graphs.search.search import (
    Incumbent,
    search_paths,
)
from scene_graph_ros.convex.graphs.search.unbounded import Places, solve_in_boxes

__all__ = ["solve_path"]

_Tried = dict[tuple[int, ...], Restricted | SolverError]
"""The best points of paths, by their edges, or why none were found."""

_ROUNDED_PATHS = 5
"""Paths that are drawn where nothing is said."""

_EXACT, _ROUGH = 1e-10, 1e-4
"""What the relaxation's solver is asked for, at best and where a path's gap may be large."""

_MANY = 0.5
"""Of all cycles of two edges: where flow goes around more of them, all are constrained at once."""


def _used(options: GraphOfConvexSetsOptions) -> tuple[Transcription, Transcription]:
    """Return the transcriptions of the whole graph and of single paths."""
    if options.convex_relaxation:
        return Transcription.RELAXATION, Transcription.RESTRICTION
    return Transcription.MIP, Transcription.MIP


def _has_surrogates(edges: Sequence[Edge]) -> bool:
    """Tell whether a relaxation has constraints that paths need not keep."""
    parts = {id(part): part for e in edges for part in (e, e.u, e.v)}
    of = (Transcription.RELAXATION, Transcription.RESTRICTION)
    return any(
        (of[0] in used and of[1] not in used)
        for part in parts.values()
        for used in part.transcriptions
    ) or _has_function_costs(edges)


def _has_function_costs(edges: Sequence[Edge]) -> bool:
    """Tell whether paths have costs that the relaxation knows nothing of."""
    parts = {id(part): part for e in edges for part in (e, e.u, e.v)}
    used = Transcription.RESTRICTION
    return any(
        isinstance(cost, FunctionCost) for part in parts.values() for cost in part.get_costs(used)
    )


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
    is_over = _Stop(options.termination_func)
    asked = None if options.termination_func is None else is_over
    problem = replace(problem, solver=options.continuous, is_over=asked)
    of_paths = replace(of_paths, solver=options.of_restriction, is_over=asked)
    network = problem.network
    tried: _Tried = {}
    has_surrogates = bool(options.convex_relaxation) and _has_surrogates(used)
    tolerance = _EXACT
    if not options.convex_relaxation:
        # What is lost of the bound, which is proven whatever the solver says, is of this size.
        tolerance = min(max(options.gap_tolerance**2, _EXACT), _ROUGH)
    least = max(options.flow_tolerance, 10.0 * tolerance)
    free = replace(of_paths, solver=options.continuous) if has_surrogates else problem
    begun = _begun((problem, free), tolerance)
    if begun is None:
        return no_path_in_time()
    problem, relaxed = begun
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
        bound = None if has_surrogates else proven
        main, _, _ = _round(of_paths, relaxed, bound, options, tried, 1)
        first = _better(first, main)
        if first is not None and _is_closed(bound, first, options):
            break
        cycles |= more
        everywhere = network.two_cycles()
        if len(cycles) > _MANY * len(everywhere):
            # Flows would turn to the others next.
            cycles = set(everywhere)
        ordered = sorted(cycles, key=lambda cycle: (cycle.vertex, cycle.into))
        again = _in_time(problem, ordered, tolerance)
        if again is None:
            break  # The flows and the bound before are good.
        relaxed = again
        tighter = bound_of_relaxation(problem, relaxed)
        if relaxed.cost == np.inf:
            return _infeasible(tighter, relaxed)
        proven = max(tighter, proven, key=lambda each: each.value)
    bound = _bound_of_paths(free, ordered, tolerance, used) if has_surrogates else proven
    rounded, count, failure = _round(of_paths, relaxed, bound, options, tried)
    rounded = _better(first, rounded)
    answer = PathAnswer(used, problem, relaxed, (free, bound))
    if options.convex_relaxation:
        found = answer.of_relaxation(rounded, count, failure)
        return ended_early(found) if is_over.has_stopped else found
    if options.mixed_integer is not None:
        path, said = solve_mixed_integer(problem, options.mixed_integer)
        exact = None if path is None else Incumbent(path, restrict(of_paths, path))
        exact = exact if exact is not None and exact.best.points else None
        return answer.of_mixed_integer(options.mixed_integer.name, exact, said)
    searched = search_paths(problem, proven, rounded, options)
    return answer.of_search(searched, count)


def _begun(problems: tuple[Problem, Problem], tolerance: float) -> tuple[Problem, Relaxed] | None:
    """Return the first problem with its relaxation, or the second where the first has none.

    The second has no surrogates: what they forbid paths may do. None where it was ended before.
    """
    first, second = problems
    relaxed = _in_time(first, (), tolerance)
    if relaxed is not None and relaxed.cost == np.inf and second is not first:
        first, relaxed = second, _in_time(second, (), tolerance)
    return None if relaxed is None else (first, relaxed)


def _bound_of_paths(
    problem: Problem, cycles: Sequence[TwoCycle], tolerance: float, edges: Sequence[Edge]
) -> ProvenBound | None:
    """Return the bound of a problem of paths, without surrogates; None where nothing is known."""
    if _has_function_costs(edges):
        return None
    relaxed = _in_time(problem, cycles, tolerance)
    return None if relaxed is None else bound_of_relaxation(problem, relaxed)


def _in_time(problem: Problem, cycles: Sequence[TwoCycle], tolerance: float) -> Relaxed | None:
    """Return the relaxation; None where it was ended before it was solved."""
    try:
        return relax(problem, cycles, tolerance)
    except StoppedError:
        return None


class _Stop:
    """Asks whether a search is to end, and remembers that it was."""

    def __init__(self, is_over: Callable[[], bool] | None) -> None:
        self._is_over, self.has_stopped = is_over, False

    def __call__(self) -> bool:
        self.has_stopped = self.has_stopped or (self._is_over is not None and self._is_over())
        return self.has_stopped


def _better(first: Incumbent | None, second: Incumbent | None) -> Incumbent | None:
    """Return the path that costs less, of those there are."""
    if first is None or (second is not None and second.best.cost < first.best.cost):
        return second
    return first


def _is_closed(
    proven: ProvenBound | None, found: Incumbent, options: GraphOfConvexSetsOptions
) -> bool:
    """Tell whether the bound is as near to a path as is asked for."""
    cost = found.best.cost
    return proven is not None and cost - proven.value <= options.gap_tolerance * abs(cost)


def _infeasible(proof: ProvenBound, relaxed: Relaxed) -> GraphOfConvexSetsResult:
    if proof.value > 0.0:
        return no_path("no path keeps the constraints of its edges, which is proven")
    raise SolverError(
        "GraphOfConvexSets.solve_shortest_path: the solver found no path that keeps the"
        f" constraints, but its proof does not hold ({proof.value:.3g} must be above 0, residual"
        f" {relaxed.residual:.1e})"
    )


def _round(
    problem: Problem,
    relaxed: Relaxed,
    proven: ProvenBound | None,
    options: GraphOfConvexSetsOptions,
    tried: _Tried,
    at_most: int | None = None,
) -> tuple[Incumbent | None, int, str]:
    """Return the best of the path with the most flow and of some that are drawn from the flows.

    And how many were tried, and a failure. Paths that were ``tried`` before are not solved again.
    No more are once one costs the proven bound of all, and at most ``at_most``, if that is less
    than the options' gap.

    A failure is the solver's status of one of them that it did not solve, else empty.
    """
    given = options.max_rounded_paths
    most = _ROUNDED_PATHS if given is None else given
    if at_most is not None:
        most = min(most, at_most)
    found: Incumbent | None = None
    failure, count = "", 0
    for path in itertools.islice(_suggested(problem.network, relaxed.flows, most, options), most):
        if problem.is_over is not None and problem.is_over():
            break
        count += 1
        if not set(problem.forced) <= set(path):
            continue
        if path not in tried:
            try:
                tried[path] = restrict(problem, path)
            except SolverError as error:
                tried[path] = error
        best = tried[path]
        if isinstance(best, SolverError):
            failure = str(best)  # of the others one may do; without any the result says so
            continue
        if best.points and (found is None or best.cost < found.best.cost):
            found = Incumbent(path, best)
            if _is_closed(proven, found, options):
                break
    return found, count, failure


def _suggested(
    network: Network, flows: np.ndarray, most: int, options: GraphOfConvexSetsOptions
) -> Iterator[tuple[int, ...]]:
    """Return the path with the most flow, and others that are drawn from the flows."""
    main = main_path(network, flows, options.flow_tolerance)
    if main is None:
        return
    yield main
    drawn = draw_paths(
        network,
        flows,
        most,
        options.max_rounding_trials,
        options.flow_tolerance,
        np.random.default_rng(options.rounding_seed),
    )
    yield from (path for path in drawn if path != main)
