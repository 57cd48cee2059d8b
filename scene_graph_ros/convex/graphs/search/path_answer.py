"""The answer about a path that was found, or about none."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from scene_graph_ros.convex.graphs.expressions.transcription import Transcription
from scene_graph_ros.convex.graphs.model.edge import Edge, Vertex
from scene_graph_ros.convex.graphs.relax.bounds import ProvenBound
from scene_graph_ros.convex.graphs.relax.later import Later, Once
from scene_graph_ros.convex.graphs.relax.relaxation import Problem, Relaxed
from scene_graph_ros.convex.graphs.search.result import (
    GraphOfConvexSetsResult,
    PathBound,
    RelaxationAnswer,
)
from scene_graph_ros.convex.graphs.search.search import Incumbent, Searched

__all__ = [
    "PathAnswer",
    "costs_at",
    "ended_early",
    "no_path",
    "no_path_in_time",
    "relaxation_answer",
    "with_points",
]


_NONE_YET = "no path was found until termination_func ended the search"
_ENDED = "termination_func ended the search"


def no_path(reason: str) -> GraphOfConvexSetsResult:
    """Return that there is no path, and why."""
    return GraphOfConvexSetsResult(False, np.inf, np.inf, reason)


def no_path_in_time() -> GraphOfConvexSetsResult:
    """Return that a search was ended before anything was known."""
    return GraphOfConvexSetsResult(False, np.inf, -np.inf, _NONE_YET, is_stopped=True)


def ended_early(found: GraphOfConvexSetsResult) -> GraphOfConvexSetsResult:
    """Return the best of the paths that were rounded until a search was ended."""
    reason = _ENDED if found.is_success else _NONE_YET
    return replace(found, reason=reason, is_stopped=True)


def costs_at(
    parts: Sequence[Vertex | Edge], points: dict[int, np.ndarray], used: Transcription
) -> Mapping[int, float]:
    """Return the costs of edges or vertices at points, by their numbers."""
    now = [(part, part.get_costs(used)) for part in parts]
    return Later(lambda: {part.id: part.cost_at(costs, points) for part, costs in now})


def with_points(
    edges: Sequence[Edge],
    found: Incumbent,
    used: Transcription,
    others: dict[str, Any],
) -> GraphOfConvexSetsResult:
    """Return a path, its points and its parts' costs, with the fields of ``others``."""
    path = [edges[e] for e in found.path]
    visited = [path[0].u, *(e.v for e in path)]
    points = dict(zip((v.id for v in visited), found.best.points, strict=True))
    return GraphOfConvexSetsResult(
        is_success=True,
        cost=found.best.cost,
        path=tuple(e.id for e in path),
        vertices=tuple(v.id for v in visited),
        points=found.best.points,
        edge_costs=costs_at(path, points, used),
        vertex_costs=costs_at(visited, points, used),
        violation=found.best.violation,
        **others,
    )


Proven = tuple[Problem, ProvenBound | None]
"""A problem, and the bound of its paths; None where nothing is known."""


def relaxation_answer(
    edges: Sequence[Edge], problem: Problem, relaxed: Relaxed, proven: Proven
) -> RelaxationAnswer:
    """Return a relaxation's answer about edges."""
    numbers = [e.id for e in edges]
    flows = np.clip(relaxed.flows, 0.0, 1.0)
    centers = [
        (problem.sets[u].center, problem.sets[v].center)
        for u, v in zip(problem.network.tails, problem.network.heads, strict=True)
    ]
    u, v = (
        {
            number: x + f * c[end]
            for number, x, f, c in zip(numbers, points, flows, centers, strict=True)
        }
        for end, points in enumerate(relaxed.points())
    )
    return RelaxationAnswer(
        relaxed.cost,
        dict(zip(numbers, flows.tolist(), strict=True)),
        u,
        v,
        None if proven[1] is None else PathBound(proven[1].value, proven[0], proven[1].potentials),
    )


class PathAnswer:
    """The answer of a relaxation, and of the path that came of it."""

    def __init__(
        self,
        edges: Sequence[Edge],
        problem: Problem,
        relaxed: Relaxed,
        proven: Proven,
    ) -> None:
        self._edges = edges
        self._bound = -np.inf if proven[1] is None else proven[1].value
        self._common: dict[str, Any] = {
            "relaxation": Once(lambda: relaxation_answer(edges, problem, relaxed, proven)),
            "num_edges_solved": sum(
                edge.id >= 0 for edge in edges
            ),  # others are of slack variables
        }

    def of_relaxation(
        self,
        found: Incumbent | None,
        count: int,
        failure: str,
        tried: Iterable[Sequence[int]] = (),
    ) -> GraphOfConvexSetsResult:
        """Return the best rounded path with the relaxation's bound."""
        others = {
            **self._common,
            "num_rounded_paths": count,
            "lower_bound": self._bound,
            "transcription": Transcription.RELAXATION,
            "rounded_paths": tuple(tuple(self._edges[e].id for e in path) for path in tried),
        }
        if found is None:
            reason = "no path was drawn: the relaxation alone was solved"
            if failure:
                reason = f"none of {count} rounded paths was solved: {failure}"
            elif count:
                reason = f"none of {count} rounded paths keeps its constraints"
            return GraphOfConvexSetsResult(is_success=False, cost=np.inf, reason=reason, **others)
        others["reason"] = f"the best of {count} rounded paths"
        return with_points(self._edges, found, Transcription.RESTRICTION, others)

    def of_mixed_integer(
        self, name: str, found: Incumbent | None, bound: float
    ) -> GraphOfConvexSetsResult:
        """Return a solver's path with the relaxation's bound, and with the solver's bound."""
        others = {**self._common, "lower_bound": self._bound, "solver_bound": bound}
        if found is None:
            reason = f"solver {name!r} says that no path keeps the constraints; it is not proven"
            return GraphOfConvexSetsResult(is_success=False, cost=np.inf, reason=reason, **others)
        others["reason"] = f"the best path, as solver {name!r} says; solver_bound is not proven"
        return with_points(self._edges, found, Transcription.MIP, others)

    def of_search(self, searched: Searched, count: int) -> GraphOfConvexSetsResult:
        """Return the best path with the search's bound."""
        others = {
            **self._common,
            "num_rounded_paths": count,
            "num_search_programs": searched.num_programs,
            "lower_bound": max(searched.lower_bound, self._bound),
            "is_stopped": searched.is_stopped,
        }
        reason = _what_ended(searched)
        if searched.found is None:
            return GraphOfConvexSetsResult(is_success=False, cost=np.inf, reason=reason, **others)
        others["reason"] = reason
        return with_points(self._edges, searched.found, Transcription.MIP, others)


def _what_ended(searched: Searched) -> str:
    """Return why a search went no further."""
    if searched.found is None:
        if searched.failure:
            return f"no path was found: {searched.failure}"
        if searched.is_complete and searched.lower_bound == np.inf:
            return "no path keeps the constraints of its edges, which is proven"
        if searched.is_stopped:
            return _NONE_YET
        return "no path was found within max_search_programs"
    if searched.failure:
        return f"a path that may be better was not solved: {searched.failure}"
    if searched.is_complete:
        return "the best path, to the tolerance"
    if searched.is_stopped:
        return _ENDED
    return "max_search_programs was reached"
