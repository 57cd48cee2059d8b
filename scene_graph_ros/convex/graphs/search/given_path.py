"""The best points of a path that is given, or of staying where it begins."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
import itertools
from typing import Any

import numpy as np

from scene_graph_ros.convex.errors import ConvexSetError, StoppedError
from scene_graph_ros.convex.graphs.expressions.transcription import Transcription
from scene_graph_ros.convex.graphs.model.edge import Edge, Vertex
from scene_graph_ros.convex.graphs.restrict.chain import Chain
from scene_graph_ros.convex.graphs.restrict.restriction import (
    best_of_chain,
    restrict,
    Restricted,
)
from scene_graph_ros.convex.graphs.search.path_answer import no_path, no_path_in_time, with_points
from scene_graph_ros.convex.graphs.search.path_problem import (
    kept_terms,
    network_of,
    problem_of,
    standing_problem,
)
from scene_graph_ros.convex.graphs.search.result import GraphOfConvexSetsResult
from scene_graph_ros.convex.graphs.search.search import Incumbent
from scene_graph_ros.convex.graphs.search.unbounded import Places, solve_in_boxes
from scene_graph_ros.convex.questions.arguments import as_vector
from scene_graph_ros.convex.sets.point import Point
from scene_graph_ros.convex.solve.cones.solver_choice import SolverChoice
from scene_graph_ros.geometry.quoting import quoted

__all__ = ["guessed_points", "solve_restriction", "stay"]


def stay(
    vertex: Vertex, edges: Sequence[Edge], used: Transcription, solver: SolverChoice | None
) -> GraphOfConvexSetsResult:
    """Return the path that begins where it ends."""
    forced = next((e for e in edges if True in e.phi_constraints), None)
    if forced is not None:
        return no_path(f"edge {forced.name!r} has to be on the path, which has none")

    def solve(places: Places | None) -> GraphOfConvexSetsResult:
        best = restrict(replace(standing_problem(vertex, used, places), solver=solver), (0,))
        if not best.points:
            return no_path(f"vertex {vertex.name!r} can't keep its constraints, which is proven")
        return GraphOfConvexSetsResult(
            True,
            best.cost,
            best.lower_bound,
            "source and target are one vertex",
            vertices=(vertex.id,),
            points=best.points[:1],
            violation=best.violation,
        )

    if vertex.is_bounded:
        return solve(None)
    nowhere = Vertex(-1, Point(), "the end")
    staying = Edge(-1, vertex, nowhere, vertex.name)
    ends = (vertex, nowhere)
    return solve_in_boxes(
        ends, [staying], ends, frozenset([used]), lambda _, __, places, ___: solve(places)
    )


def solve_restriction(
    active: Sequence[Edge],
    guess: Sequence[np.ndarray] | None = None,
    solver: SolverChoice | None = None,
    is_over: Callable[[], bool] | None = None,
    limit: float = np.inf,
) -> GraphOfConvexSetsResult:
    """Return the best points of a path, as `solve_convex_restriction` promises.

    None where ``is_over`` says that it is time to stop before they are found. Of a path whose
    convex part costs ``limit`` at least there may be the lower bound alone.
    """
    if is_over is not None and is_over():
        return no_path_in_time()
    try:
        return _restricted(active, guess, solver, is_over, limit)
    except StoppedError:
        return no_path_in_time()


def _restricted(
    active: Sequence[Edge],
    guess: Sequence[np.ndarray] | None,
    solver: SolverChoice | None,
    is_over: Callable[[], bool] | None,
    limit: float,
) -> GraphOfConvexSetsResult:
    """Return the best points of a path. Raises StoppedError where it was ended before."""
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
    used, ends = Transcription.RESTRICTION, (visited[0], visited[-1])
    found = None if solver is not None else _quickly(visited, active, used)
    if found is not None:
        return found

    def solve(places: Places | None, most: float = np.inf) -> GraphOfConvexSetsResult:
        problem = problem_of(
            visited, active, network_of(visited, active, *ends), used, None, places
        )
        problem = replace(problem, solver=solver, is_over=is_over)
        best = restrict(problem, range(len(active)), guess, limit=most)
        if not best.points:
            if best.lower_bound < np.inf:
                return replace(no_path("it costs too much"), lower_bound=best.lower_bound)
            return no_path("the path can't keep its constraints, which is proven")
        return _answer(visited, active, best, used)

    if all(vertex.is_bounded for vertex in visited):
        return solve(None, limit)

    def solve_in(
        some: Sequence[Vertex], _: Sequence[Edge], places: Places, __: bool
    ) -> GraphOfConvexSetsResult:
        if len(some) < len(visited):
            return no_path("the path can't keep its constraints, which is proven")
        return solve(places)

    return solve_in_boxes(visited, active, ends, frozenset([used]), solve_in)


def _quickly(
    visited: Sequence[Vertex], active: Sequence[Edge], used: Transcription
) -> GraphOfConvexSetsResult | None:
    """Return the best points by the method for paths; None where it is none for this one."""
    if any(part.has_functions for part in (*active, *visited)):
        return None
    if not all(vertex.is_bounded for vertex in visited):
        return None
    terms = kept_terms(active, visited[0], used)
    best = best_of_chain(Chain(terms, [vertex.placed for vertex in visited]))
    return None if best is None else _answer(visited, active, best, used)


def _answer(
    visited: Sequence[Vertex], active: Sequence[Edge], best: Restricted, used: Transcription
) -> GraphOfConvexSetsResult:
    others = {"lower_bound": best.lower_bound, "reason": "the path was given"}
    found = Incumbent(tuple(range(len(active))), best)
    return with_points(active, found, used, others)


def guessed_points(guess: Any, edges: Sequence[Edge]) -> list[np.ndarray] | None:
    """Return the points ``(n,)`` guessed of a path's vertices, by a mapping or by a result.

    None where nothing is guessed, or the path has no edge. Raises ConvexSetError.
    """
    if not isinstance(guess, (GraphOfConvexSetsResult, Mapping, type(None))):
        raise ConvexSetError(
            "GraphOfConvexSets.solve_convex_restriction: initial_guess must be a mapping of"
            f" vertices to points, a result or None, not {quoted(guess)}"
        )
    if guess is None or not edges:
        return None
    return [_guessed(guess, vertex) for vertex in (edges[0].u, *(edge.v for edge in edges))]


def _guessed(guess: GraphOfConvexSetsResult | Mapping[Vertex, Any], vertex: Vertex) -> np.ndarray:
    """Return the point ``(n,)`` that is guessed of a vertex."""
    point = (
        vertex.get_solution(guess)
        if isinstance(guess, GraphOfConvexSetsResult)
        else guess.get(vertex)
    )
    label = f"GraphOfConvexSets.solve_convex_restriction: initial_guess of {vertex.name!r}"
    if point is None:
        raise ConvexSetError(f"{label} is missing")
    return as_vector(point, label, vertex.ambient_dimension)
