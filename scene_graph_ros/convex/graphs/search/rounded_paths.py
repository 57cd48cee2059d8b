"""Paths that a relaxation suggests, the best of them, and the bound of all."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
import itertools

import numpy as np

from scene_graph_ros.convex.errors import SolverError, StoppedError
from scene_graph_ros.convex.graphs.expressions.functions import FunctionCost
from scene_graph_ros.convex.graphs.expressions.transcription import Transcription
from scene_graph_ros.convex.graphs.model.edge import Edge
from scene_graph_ros.convex.graphs.model.options import GraphOfConvexSetsOptions
from scene_graph_ros.convex.graphs.network.network import Network, TwoCycle
from scene_graph_ros.convex.graphs.network.rounding import draw_paths, main_path
from scene_graph_ros.convex.graphs.relax.bounds import bound_of_relaxation, ProvenBound
from scene_graph_ros.convex.graphs.relax.relaxation import Problem, relax, Relaxed
from scene_graph_ros.convex.graphs.restrict.restriction import restrict, Restricted
from scene_graph_ros.convex.graphs.search.search import Incumbent

__all__ = [
    "Stop",
    "Tried",
    "begun",
    "better",
    "has_surrogates",
    "in_time",
    "is_closed",
    "round_paths",
    "rounded_path",
]

Tried = dict[tuple[int, ...], Restricted | SolverError]
"""The best points of paths, by their edges, or why none were found."""

_ROUNDED_PATHS = 5
"""Paths that are drawn where nothing is said."""


def has_surrogates(edges: Sequence[Edge]) -> bool:
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


def begun(problems: tuple[Problem, Problem], tolerance: float) -> tuple[Problem, Relaxed] | None:
    """Return the first problem with its relaxation, or the second where the first has none.

    The second has no surrogates: what they forbid paths may do. None where it was ended before.
    """
    first, second = problems
    relaxed = in_time(first, (), tolerance)
    if relaxed is not None and relaxed.cost == np.inf and second is not first:
        first, relaxed = second, in_time(second, (), tolerance)
    return None if relaxed is None else (first, relaxed)


def rounded_path(
    problems: tuple[Problem, Problem],
    known: tuple[Relaxed, ProvenBound],
    how: tuple[Sequence[TwoCycle], float],
    edges: Sequence[Edge],
    options: GraphOfConvexSetsOptions,
    tried: Tried,
    first: Incumbent | None,
) -> tuple[Incumbent | None, int, str, ProvenBound | None]:
    """Return the best rounded path, how many there were, a failure, and the bound of all paths.

    ``first`` is the best that is known before, and is returned where no other costs less.
    ``problems`` are that of paths, and the one that a bound is of. Where it is not the one that
    was relaxed, it is relaxed now; where paths have a choice in it, those of its flows are tried.
    """
    of_paths, free = problems
    limit = np.inf if first is None else first.best.cost
    if not (bool(options.convex_relaxation) and has_surrogates(edges)):
        rounded, count, failure = round_paths(
            of_paths, known[0], known[1], options, tried, limit=limit
        )
        return better(first, rounded), count, failure, known[1]
    relaxed, bound = _bound_of_paths(free, *how, edges)
    rounded, count, failure = round_paths(of_paths, known[0], bound, options, tried, limit=limit)
    rounded = better(first, rounded)
    if free.terms is not of_paths.terms and relaxed is not None:
        limit = np.inf if rounded is None else rounded.best.cost
        more, others, _ = round_paths(of_paths, relaxed, bound, options, tried, limit=limit)
        rounded, count = better(rounded, more), count + others
    return rounded, count, failure, bound


def _bound_of_paths(
    problem: Problem, cycles: Sequence[TwoCycle], tolerance: float, edges: Sequence[Edge]
) -> tuple[Relaxed | None, ProvenBound | None]:
    """Return the relaxation without surrogates, and its bound; None where nothing is known."""
    relaxed = None if _has_function_costs(edges) else in_time(problem, cycles, tolerance)
    if relaxed is None or relaxed.cost == np.inf:
        return None, None
    return relaxed, bound_of_relaxation(problem, relaxed)


def in_time(problem: Problem, cycles: Sequence[TwoCycle], tolerance: float) -> Relaxed | None:
    """Return the relaxation; None where it was ended before it was solved."""
    try:
        return relax(problem, cycles, tolerance)
    except StoppedError:
        return None


class Stop:
    """Asks whether a search is to end, and remembers that it was."""

    def __init__(self, is_over: Callable[[], bool] | None) -> None:
        self._is_over, self.has_stopped = is_over, False

    def __call__(self) -> bool:
        """Tell whether it is."""
        self.has_stopped = self.has_stopped or (self._is_over is not None and self._is_over())
        return self.has_stopped


def better(first: Incumbent | None, second: Incumbent | None) -> Incumbent | None:
    """Return the path that costs less, of those there are."""
    if first is None or (second is not None and second.best.cost < first.best.cost):
        return second
    return first


def is_closed(
    proven: ProvenBound | None, found: Incumbent, options: GraphOfConvexSetsOptions
) -> bool:
    """Tell whether the bound is as near to a path as is asked for."""
    cost = found.best.cost
    return proven is not None and cost - proven.value <= options.gap_tolerance * abs(cost)


def round_paths(
    problem: Problem,
    relaxed: Relaxed,
    proven: ProvenBound | None,
    options: GraphOfConvexSetsOptions,
    tried: Tried,
    at_most: int | None = None,
    limit: float = np.inf,
) -> tuple[Incumbent | None, int, str]:
    """Return the best of the path with the most flow and of some that are drawn from the flows.

    And how many were tried, and a failure. Paths that were ``tried`` before are not solved again.
    No more are once one costs the proven bound of all, and at most ``at_most``, if that is less
    than the options' gap. Those that can't cost less than ``limit`` need not be solved.

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
                # One that can't be better need not be made smooth.
                most_cost = limit if found is None else min(limit, found.best.cost)
                tried[path] = restrict(problem, path, limit=most_cost)
            except SolverError as error:
                tried[path] = error
        best = tried[path]
        if isinstance(best, SolverError):
            failure = str(best)  # of the others one may do; without any the result says so
            continue
        if best.points and (found is None or best.cost < found.best.cost):
            found = Incumbent(path, best)
            if is_closed(proven, found, options):
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
