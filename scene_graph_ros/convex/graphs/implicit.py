"""Graphs of convex sets that are made while they are searched."""

from __future__ import annotations

import abc
from collections import deque
from collections.abc import Callable, Iterable
from typing import Any

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.convex.graphs.graph import GraphOfConvexSets
from scene_graph_ros.convex.graphs.model.edge import Edge, Vertex
from scene_graph_ros.convex.graphs.model.options import (
    as_options,
    GraphOfConvexSetsOptions,
)
from scene_graph_ros.convex.graphs.search.forward_search import ForwardSearch
from scene_graph_ros.convex.graphs.search.result import GraphOfConvexSetsResult
from scene_graph_ros.convex.graphs.search.with_slack import as_asked, ForwardSlack
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted

__all__ = ["ImplicitGraphOfConvexSets"]


@one_line("gcs")
class ImplicitGraphOfConvexSets(abc.ABC):
    """A graph that says where one gets from a vertex when it is asked.

    Derive from it, and give a vertex to begin with. `do_successors` adds the needed parts to
    `gcs`.
    """

    def __init__(self) -> None:
        self._graph = GraphOfConvexSets()
        self._successors: dict[int, list[Edge]] = {}

    @property
    def gcs(self) -> GraphOfConvexSets:
        """The graph as far as it is made."""
        return self._graph

    @abc.abstractmethod
    def do_successors(self, v: Vertex) -> Iterable[Edge]:
        """Add the edges out of a vertex, with the vertices that they lead to, and return them.

        Called once for each vertex.
        """

    def successors(self, v: Vertex) -> list[Edge]:
        """Return the edges out of a vertex; the graph grows by them when they are first asked for.

        Raises ConvexSetError for a vertex of another graph, and where `do_successors` returns an
        object that is no edge from it.
        """
        self._check_vertex(v, "successors: v")
        if v.id not in self._successors:
            edges: list[Any] = list(self.do_successors(v))
            for edge in edges:
                if not isinstance(edge, Edge) or not self._graph.is_valid(edge) or edge.u is not v:
                    raise ConvexSetError(
                        f"do_successors of {v.name!r} must return edges of gcs that lead from it,"
                        f" not {quoted(edge)}"
                    )
            self._successors[v.id] = edges
        return list(self._successors[v.id])

    def _check_vertex(self, vertex: Any, label: str) -> None:
        if not isinstance(vertex, Vertex) or not self._graph.is_valid(vertex):
            raise ConvexSetError(
                f"ImplicitGraphOfConvexSets.{label} must be a vertex of gcs, not {quoted(vertex)}"
            )

    def expand_recursively(self, start: Vertex, max_successor_calls: int = 1000) -> bool:
        """Ask for the successors of all that is reached from a vertex, the nearest by edges first.

        Returns whether nothing is left to ask for; it ends after ``max_successor_calls``. Raises
        ConvexSetError as `successors` does.
        """
        most = _whole(max_successor_calls, "expand_recursively: max_successor_calls")
        self._check_vertex(start, "expand_recursively: start")
        seen, waiting = {start.id}, deque([start])
        for _ in range(most):
            if not waiting:
                break
            for edge in self.successors(waiting.popleft()):
                if edge.v.id not in seen:
                    seen.add(edge.v.id)
                    waiting.append(edge.v)
        return not waiting

    def solve_shortest_path(
        self,
        source: Vertex,
        target: Vertex | Callable[[Vertex], bool],
        options: GraphOfConvexSetsOptions | None = None,
        *,
        heuristic: Callable[[Vertex], Any] | None = None,
        max_successor_calls: int = 1000,
        max_paths_per_vertex: int | None = None,
    ) -> GraphOfConvexSetsResult:
        """Return a path to a vertex, or to one that a function says True of, with a proven gap.

        Best first, and the graph is made only where it is searched. ``heuristic`` returns an
        expression of ``vertex.x``, as costs are, that no way from there to the target costs less
        than; by default nothing. The bound is proven as far as that is true. It ends where the
        cost is within ``options.gap_tolerance`` of the bound, after
        ``options.max_search_programs`` or ``max_successor_calls``. With ``max_paths_per_vertex``
        only so many starts of paths go on from each vertex; the others' least costs count in the
        bound, so that the gap stays true.

        Raises ConvexSetError for a vertex of another graph.
        """
        self.successors(source)
        if isinstance(target, Vertex) and not self._graph.is_valid(target):
            raise ConvexSetError(
                "ImplicitGraphOfConvexSets.solve_shortest_path: target must be a vertex of gcs,"
                f" not {quoted(target)}"
            )
        most_calls = _whole(max_successor_calls, "solve_shortest_path: max_successor_calls")
        most_paths = (
            None
            if max_paths_per_vertex is None
            else _whole(max_paths_per_vertex, "solve_shortest_path: max_paths_per_vertex")
        )
        with_slack = ForwardSlack(
            self.successors,
            (lambda v: v is target) if isinstance(target, Vertex) else target,
            heuristic,
        )
        search = ForwardSearch(
            with_slack.successors,
            with_slack.lifted.vertex(source),
            with_slack.is_target,
            as_options(options, "ImplicitGraphOfConvexSets.solve_shortest_path"),
            None if heuristic is None else with_slack.heuristic,
            most_calls,
            most_paths,
        )
        return as_asked(search.run(), with_slack.lifted)


def _whole(value: Any, label: str) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or value < 1:
        raise ConvexSetError(
            f"ImplicitGraphOfConvexSets.{label} must be a whole number, at least 1, not"
            f" {quoted(value)}"
        )
    return value
