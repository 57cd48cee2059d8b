"""Motions that stop between two segments, where equal durations cost more.

Where a derivative of the path r(s) goes on, and that of q(t), too, either both segments take the
same time or the derivative is 0 where they meet: each is a convex constraint. Paths are solved
with equal durations first. Then meetings become stops one after the other, each time the one that
saves most, until none saves anything.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from scene_graph_ros.convex.errors import SolverError
from scene_graph_ros.convex.graphs.expressions.expressions import Constraint
from scene_graph_ros.convex.graphs.expressions.transcription import Transcription
from scene_graph_ros.convex.graphs.model.edge import Edge
from scene_graph_ros.convex.graphs.model.options import GraphOfConvexSetsOptions
from scene_graph_ros.convex.graphs.model.whole_edits import Undo
from scene_graph_ros.convex.graphs.search.path_answer import no_path
from scene_graph_ros.convex.graphs.search.result import GraphOfConvexSetsResult
from scene_graph_ros.convex.graphs.search.with_slack import solve_restriction

__all__ = ["Tie", "best_with_stops", "bound_of_given", "restricted", "ties_undone"]

_SAVING = 1e-4
"""Of a cost: what stops must save at least, all of them or a further one."""

_MOST = 8
"""Meetings that are tried: those whose durations differ most where they are free to."""

Solve = Callable[[Sequence[Edge], float], GraphOfConvexSetsResult]
"""Returns a path's best points; of one that costs a limit at least perhaps its bound alone."""


class Tie(NamedTuple):
    """What ties two segments of an edge, and what is asked there in its place."""

    edge: Edge
    held: tuple[Constraint, ...]
    """Equal durations, and linear constraints that hold with them alone."""
    stopped: tuple[Constraint, ...]
    """Derivatives that are 0 on both sides."""

    def free(self) -> None:
        """Ask for neither."""
        for each in (*self.held, *self.stopped):
            self.edge.discard_constraint(each)

    def hold(self) -> None:
        """Ask for equal durations."""
        self._ask(self.held)

    def stop(self) -> None:
        """Ask for a stop."""
        self._ask(self.stopped)

    def _ask(self, wanted: Iterable[Constraint]) -> None:
        self.free()
        for each in wanted:
            self.edge.add_constraint(each, Transcription.RESTRICTION)


def ties_undone(ties: Iterable[Tie]) -> Undo:
    """Return a function that ties again what is tied."""
    kept = list(ties)

    def undo() -> None:
        for tie in kept:
            tie.hold()

    return undo


def restricted(options: GraphOfConvexSetsOptions | None) -> Solve:
    """Return the function that solves a path as `solve_convex_restriction` does."""
    solver = None if options is None else options.of_restriction
    is_over = None if options is None else options.termination_func
    return lambda edges, limit: solve_restriction(edges, None, solver, is_over, limit)


def best_with_stops(
    found: GraphOfConvexSetsResult,
    ties: Mapping[int, Tie],
    edges: Mapping[int, Edge],
    solve: Solve,
) -> GraphOfConvexSetsResult:
    """Return the best of the paths that a search compared, with stops where they save something.

    ``ties`` and ``edges`` are by the numbers of edges; ``solve`` returns a path's best points.
    """
    best = found
    for path in dict.fromkeys((found.path, *found.rounded_paths)):
        on_way = [ties[number] for number in path if number in ties]
        if not on_way:
            continue
        if best.cost <= best.lower_bound * (1.0 + _SAVING):
            break
        way = [edges[number] for number in path]
        stopped = _with_stops(best.cost, _inner(way), on_way, solve)
        if stopped is not None:
            best = _moved(found, way, stopped)
    return best


def bound_of_given(
    found: GraphOfConvexSetsResult, ties: Sequence[Tie], edges: Sequence[Edge], solve: Solve
) -> GraphOfConvexSetsResult:
    """Return the result of a path that is given, with the bound of all choices along it."""
    least = _untied(ties, edges, solve, np.inf) if ties else None
    if least is None:
        return replace(found, lower_bound=-np.inf) if ties and found.is_success else found
    path = tuple(edge.id for edge in edges)
    return replace(found, lower_bound=least.lower_bound, rounded_paths=(path,))


def _inner(way: Sequence[Edge]) -> list[Edge]:
    """Return a path without the edges from a vertex of no dimension, or to one.

    Such are a source or a target of several regions.
    """
    return [e for e in way if e.u.ambient_dimension and e.v.ambient_dimension]


def _with_stops(
    cost: float, edges: Sequence[Edge], on_way: Sequence[Tie], solve: Solve
) -> GraphOfConvexSetsResult | None:
    """Return the points of a path that cost less than so much, with stops; None without any."""
    least = _untied(on_way, edges, solve, cost * (1.0 - _SAVING))
    if least is None or cost <= least.cost * (1.0 + _SAVING):
        return None
    apart = [_difference(least, tie) for tie in on_way]
    order = sorted(range(len(on_way)), key=lambda k: -apart[k])[:_MOST]
    candidates = [on_way[k] for k in order if apart[k] > _SAVING]
    best: GraphOfConvexSetsResult | None = None
    # Those that saved something the time before are tried first, and others if none of them does.
    waiting: list[Tie] = []
    while (candidates or waiting) and cost > least.cost * (1.0 + _SAVING):
        most = limit = cost * (1.0 - _SAVING)
        tries: list[GraphOfConvexSetsResult] = []
        for tie in candidates:
            tries.append(_stopped_at(tie, solve, edges, limit))
            limit = min(limit, tries[-1].cost)
        # One that can't be the best of these may be the best of the next.
        saving = [(x.cost if x.is_success else x.lower_bound) < most for x in tries]
        idle = [tie for tie, saves in zip(candidates, saving, strict=True) if not saves]
        if limit == most:
            if not waiting:
                break
            candidates, waiting = waiting, []
            continue
        k = min(range(len(tries)), key=lambda k: tries[k].cost)
        best, cost = tries[k], tries[k].cost
        candidates[k].stop()
        waiting += idle
        candidates = [tie for j, tie in enumerate(candidates) if saving[j] and j != k]
    for tie in on_way:
        tie.hold()
    return best


def _untied(
    ties: Sequence[Tie], edges: Sequence[Edge], solve: Solve, limit: float
) -> GraphOfConvexSetsResult | None:
    """Return the points of a path where neither is asked; None where there are none.

    None, too, where their convex part costs ``limit`` at least.
    """
    for tie in ties:
        tie.free()
    least = _tried(solve, edges, limit)
    for tie in ties:
        tie.hold()
    return least if least is not None and least.is_success else None


def _stopped_at(
    tie: Tie, solve: Solve, edges: Sequence[Edge], limit: float
) -> GraphOfConvexSetsResult:
    tie.stop()
    answer = _tried(solve, edges, limit)
    tie.hold()
    return no_path("") if answer is None else answer


def _tried(solve: Solve, edges: Sequence[Edge], limit: float) -> GraphOfConvexSetsResult | None:
    """Return the best points of a path; None where the solver failed."""
    try:
        return solve(edges, limit)
    except SolverError:
        return None


def _difference(found: GraphOfConvexSetsResult, tie: Tie) -> float:
    """Return the difference of two durations, by the longer of them."""
    durations = dict(zip(found.vertices, (x[-1] for x in found.points), strict=True))
    u, v = float(durations[tie.edge.u.id]), float(durations[tie.edge.v.id])
    return abs(u - v) / max(u, v)


def _moved(
    found: GraphOfConvexSetsResult, way: Sequence[Edge], best: GraphOfConvexSetsResult
) -> GraphOfConvexSetsResult:
    """Return a search's result with another path and its points."""
    points = dict(zip(best.vertices, best.points, strict=True))
    vertices = (way[0].u, *(edge.v for edge in way))
    return replace(
        found,
        is_success=True,
        reason=found.reason if found.is_success else "a path with stops",
        cost=best.cost,
        path=tuple(edge.id for edge in way),
        vertices=tuple(vertex.id for vertex in vertices),
        points=tuple(points.get(vertex.id, np.zeros(0)) for vertex in vertices),
        edge_costs={edge.id: best.edge_costs.get(edge.id, 0.0) for edge in way},
        vertex_costs={v.id: best.vertex_costs.get(v.id, 0.0) for v in vertices},
        violation=best.violation,
    )
