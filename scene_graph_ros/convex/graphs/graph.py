"""Graphs whose vertices are convex sets, and shortest paths through them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
import itertools
from typing import Any, TypeVar

import numpy as np

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.convex.graphs.graphviz import graphviz_string
from scene_graph_ros.convex.graphs.model.checked_result import checked_result
from scene_graph_ros.convex.graphs.model.edge import Edge, Vertex
from scene_graph_ros.convex.graphs.model.edge_table import EdgeTable
from scene_graph_ros.convex.graphs.model.options import (
    as_options,
    GcsGraphvizOptions,
    GraphOfConvexSetsOptions,
)
from scene_graph_ros.convex.graphs.model.whole_edits import Undo
from scene_graph_ros.convex.graphs.network.network import Network
from scene_graph_ros.convex.graphs.network.rounding import draw_paths
from scene_graph_ros.convex.graphs.search import with_slack
from scene_graph_ros.convex.graphs.search.flow_paths import path_along_flows
from scene_graph_ros.convex.graphs.search.result import GraphOfConvexSetsResult
from scene_graph_ros.convex.questions.arguments import as_list, as_nonnegative
from scene_graph_ros.convex.sets.convex_set import ConvexSet
from scene_graph_ros.geometry.model.writes import Writes
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted

__all__ = ["GraphOfConvexSets"]

Part = TypeVar("Part", Vertex, Edge)


@one_line("num_vertices", "num_edges")
class GraphOfConvexSets:
    """Vertices are convex sets, edges have costs and constraints of a point in each.

    A path visits no vertex twice. Its cost is the sum of its edges' and vertices' costs at its
    points, one of each set on it (Marcucci, Umenberger, Parrilo and Tedrake, "Shortest Paths in
    Graphs of Convex Sets", SIAM Journal on Optimization 34(1), 2024). Where sets are unbounded,
    costs and constraints have to bound the points of paths.
    """

    # What is in the tables is of the graph. An addition is one write to them; a removal happens
    # once its writes are known, and whoever looks at the graph does those that are left. Before
    # either, what was derived is forgotten. Vertices may know more edges, and leave them out.

    def __init__(self) -> None:
        self._vertices: dict[int, Vertex] = {}
        self._edges: EdgeTable[Edge] = EdgeTable()
        self._phi: dict[int, frozenset[bool]] = {}
        self._ends: tuple[dict[int, int], np.ndarray, np.ndarray] | None = None

    @property
    def vertices(self) -> list[Vertex]:
        """All vertices, in the order in which they were added."""
        return list(self._vertices_now().values())

    @property
    def edges(self) -> list[Edge]:
        """All edges, in the order in which they were added."""
        return list(self._edges.now().values())

    @property
    def num_vertices(self) -> int:
        """The number of vertices."""
        return len(self._vertices_now())

    @property
    def num_edges(self) -> int:
        """The number of edges."""
        return len(self._edges.now())

    def add_vertex(self, set: ConvexSet, name: str = "") -> Vertex:  # noqa: A002  the spec's name
        """Add a set. Raises ConvexSetError unless it has a point; it may be unbounded."""
        if not isinstance(set, ConvexSet):
            raise ConvexSetError(f"{_set_of(name)} must be a ConvexSet, not {quoted(set)}")
        if set.is_empty():
            raise ConvexSetError(f"{_set_of(name)}, {quoted(set)}, is empty; leave the vertex out")
        number = next(self._edges.numbers)
        return self._put_vertex(Vertex(number, set, name or f"v{number}", self._edges))

    def add_edge(self, u: Vertex, v: Vertex, name: str = "") -> Edge:
        """Add an edge from one vertex to another; there may be several between the same two."""
        self._check_ends(u, v, "add_edge")
        number = next(self._edges.numbers)
        return self._put_edge(Edge(number, u, v, name or f"e{number}", self._phi))

    def _put_vertex(self, vertex: Vertex) -> Vertex:
        self._ends = None
        self._vertices[vertex.id] = vertex
        return vertex

    def _put_edge(self, edge: Edge) -> Edge:
        number = edge.id
        edge.u._outgoing[number] = edge.v._incoming[number] = edge
        self._ends = None
        self._edges.now()[number] = edge
        return edge

    def add_vertex_from_template(self, template: Vertex) -> Vertex:
        """Add a vertex with the set, name, costs and constraints of one of this or another graph.

        Raises ConvexSetError for what is no vertex.
        """
        _check_kind(template, Vertex, "add_vertex_from_template: template must be a Vertex")
        vertex = Vertex(next(self._edges.numbers), template.set, template.name, self._edges)
        vertex._take_terms(template, {template.id: vertex.id})
        return self._put_vertex(vertex)

    def add_edge_from_template(self, u: Vertex, v: Vertex, template: Edge) -> Edge:
        """Add an edge from u to v with the name, costs and constraints of one of any graph.

        Whether that has to be on the path is not taken. Raises ConvexSetError for what is no edge,
        and where u or v have other dimensions than its vertices.
        """
        _check_kind(template, Edge, "add_edge_from_template: template must be an Edge")
        self._check_ends(u, v, "add_edge_from_template")
        for name, own, given in (("u", u, template.u), ("v", v, template.v)):
            if own.ambient_dimension != given.ambient_dimension:
                raise ConvexSetError(
                    f"GraphOfConvexSets.add_edge_from_template: {name} has dimension"
                    f" {own.ambient_dimension}, that of the template {given.ambient_dimension}"
                )
        edge = Edge(next(self._edges.numbers), u, v, template.name, self._phi)
        edge._take_terms(template, {template.u.id: u.id, template.v.id: v.id})
        return self._put_edge(edge)

    def clone(self) -> GraphOfConvexSets:
        """Return another graph with the same vertices and edges, costs and constraints.

        In the same order and with the same numbers, so results of one are understood by the other,
        and expressions of one may be added to the other.
        """
        copy, last = GraphOfConvexSets(), -1
        for vertex in self.vertices:
            own = copy._put_vertex(Vertex(vertex.id, vertex.set, vertex.name, copy._edges))
            own._take_terms(vertex)
            last = max(last, vertex.last_number)
        for edge in self.edges:
            u, v = copy._vertices[edge.u.id], copy._vertices[edge.v.id]
            copy._put_edge(Edge(edge.id, u, v, edge.name, copy._phi))._take_terms(edge)
            last = max(last, edge.last_number)
        copy._phi.update(self._phi)
        copy._edges.numbers = itertools.count(last + 1)
        return copy

    def remove_vertex(self, vertex: Vertex) -> None:
        """Remove a vertex and all its edges. Raises ConvexSetError unless it is of this graph."""
        self._check_vertex(vertex, "remove_vertex: vertex")
        self._remove(self._removal([vertex]))

    def _vertices_now(self) -> dict[int, Vertex]:
        """Return the vertices, after finishing an interrupted removal."""
        self._edges.now()
        return self._vertices

    def _removal(self, vertices: Iterable[Vertex]) -> Writes:
        """Return the writes that remove vertices and all their edges."""
        writes = Writes()
        for vertex in vertices:
            writes.drop(self._vertices, vertex.id)
            for edge in (*vertex._incoming.values(), *vertex._outgoing.values()):
                self._drop_edge(writes, edge)
        return writes

    def _drop_edge(self, writes: Writes, edge: Edge) -> None:
        number = edge.id
        writes.drop(self._edges.now(), number)
        writes.drop(edge.u._outgoing, number)
        writes.drop(edge.v._incoming, number)

    def _remove(self, writes: Writes) -> None:
        """Have a removal happen."""
        self._ends = None
        self._edges.remove(writes)

    def _additions_undone(self) -> Undo:
        """Return a function that takes back the vertices and edges added from now on."""
        tables = (self._vertices_now(), self._edges.now())
        last = max(next(reversed(table), -1) for table in tables)

        def undo() -> None:
            writes = Writes()
            for edge in _added(self._edges.now(), last):
                self._drop_edge(writes, edge)
            for vertex in _added(self._vertices, last):
                writes.drop(self._vertices, vertex.id)
            self._remove(writes)

        return undo

    def remove_edge(self, edge: Edge) -> None:
        """Remove an edge. Raises ConvexSetError unless it is of this graph."""
        self._check_edge(edge, "remove_edge: edge")
        self._ends = None
        number = edge.id
        del self._edges.now()[number]
        edge._u._outgoing.pop(number, None)
        edge._v._incoming.pop(number, None)

    def is_valid(self, of: Vertex | Edge) -> bool:
        """Tell whether a vertex or an edge is of this graph."""
        edges = self._edges.now()
        own = edges if isinstance(of, Edge) else self._vertices
        return own.get(getattr(of, "_id", -1)) is of

    def clear_all_phi_constraints(self) -> None:
        """Allow every edge to be on the path or not."""
        self._phi.clear()

    def solve_shortest_path(
        self,
        source: Vertex,
        target: Vertex,
        options: GraphOfConvexSetsOptions | None = None,
    ) -> GraphOfConvexSetsResult:
        """Return the shortest path from some point of one set to some point of another.

        By default it is searched until its cost is within ``options.gap_tolerance`` of a lower
        bound of all paths; with ``options.convex_relaxation`` the best of some paths that the
        relaxation suggests, with the relaxation's bound. Both bounds are computed by weak duality
        from multipliers, with rounding counted against them. Where no path leads to the target,
        or none keeps the constraints, ``is_success`` is False and ``reason`` says so.

        Raises ConvexSetError for a vertex of another graph, for costs that may be negative and
        for unbounded sets in which the cost goes down for ever, SolverError with its residuals
        where the solver failed.
        """
        self._check_vertex(source, "solve_shortest_path: source")
        self._check_vertex(target, "solve_shortest_path: target")
        chosen = as_options(options, "GraphOfConvexSets.solve_shortest_path")
        return with_slack.solve_path(
            self.vertices, self.edges, self._network(source, target), chosen
        )

    def solve_convex_restriction(
        self,
        active_edges: Sequence[Edge],
        options: GraphOfConvexSetsOptions | None = None,
        initial_guess: GraphOfConvexSetsResult | Mapping[Vertex, Any] | None = None,
    ) -> GraphOfConvexSetsResult:
        """Return the best points of one path, given by its edges in order.

        Of the options ``restriction_solver``, else ``solver``, and ``termination_func`` count.

        With functions that need not be convex, the best that were found near those of the convex
        part, or near ``initial_guess``: points ``(n,)`` of all its vertices, or a result that has
        them. Where the path can't keep its constraints ``is_success`` is False. Raises
        ConvexSetError for edges that are no path, SolverError where the solver failed.
        """
        label = "solve_convex_restriction: active_edges"
        edges = as_list(active_edges, f"GraphOfConvexSets.{label}")
        for edge in edges:
            self._check_edge(edge, label)
        chosen = as_options(options, "GraphOfConvexSets.solve_convex_restriction")
        solver = None if options is None else chosen.of_restriction
        return with_slack.solve_restriction(edges, initial_guess, solver, chosen.termination_func)

    def sample_paths(
        self,
        source: Vertex,
        target: Vertex,
        flows: Mapping[Edge, float] | GraphOfConvexSetsResult,
        options: GraphOfConvexSetsOptions | None = None,
    ) -> list[list[Edge]]:
        """Return different paths, drawn with the probabilities of flows, or of a result's.

        At most ``options.max_rounded_paths`` of ``options.max_rounding_trials``, from
        ``options.rounding_seed``. Edges without a flow don't count.
        """
        self._check_vertex(source, "sample_paths: source")
        self._check_vertex(target, "sample_paths: target")
        chosen = as_options(options, "GraphOfConvexSets.sample_paths")
        kinds = (GraphOfConvexSetsResult, Mapping)
        wanted = "flows must be a mapping of edges to flows, or a result that has them"
        _check_kind(flows, kinds, f"sample_paths: {wanted}")
        edges = self.edges
        given = flows.flows if isinstance(flows, GraphOfConvexSetsResult) else self._by_id(flows)
        shares = [given.get(edge.id, 0.0) for edge in edges]
        most = 5 if chosen.max_rounded_paths is None else chosen.max_rounded_paths
        if most < 1:
            raise ConvexSetError(
                "GraphOfConvexSets.sample_paths: options.max_rounded_paths must be at least 1, not"
                f" {most}"
            )
        found = draw_paths(
            self._network(source, target),
            np.array(shares),
            most,
            chosen.max_rounding_trials,
            chosen.flow_tolerance,
            np.random.default_rng(chosen.rounding_seed),
        )
        return [[edges[e] for e in path] for path in found]

    def get_solution_path(
        self,
        source: Vertex,
        target: Vertex,
        result: GraphOfConvexSetsResult,
        tolerance: float = 1e-3,
    ) -> list[Edge]:
        """Return the edges of a result's path.

        Of a relaxation without a path, those along which all but ``tolerance`` of the flow goes.
        Raises ConvexSetError where there is no such path.
        """
        self._check_vertex(source, "get_solution_path: source")
        self._check_vertex(target, "get_solution_path: target")
        checked_result(result, "GraphOfConvexSets.get_solution_path")
        most = as_nonnegative(tolerance, "GraphOfConvexSets.get_solution_path: tolerance")
        is_own = result.vertices[:1] == (source.id,) and result.vertices[-1:] == (target.id,)
        if result.is_success and is_own:
            return [self._edges.now()[e] for e in result.path]
        return path_along_flows(source, target, result.flows, most)

    def get_graphviz_string(
        self,
        result: GraphOfConvexSetsResult | None = None,
        options: GcsGraphvizOptions | None = None,
        active_path: Sequence[Edge] = (),
    ) -> str:
        """Return the graph in the DOT language, with a result's numbers where one is given.

        ``active_path`` is drawn a second time, dashed and red.
        """
        label = "get_graphviz_string: active_path"
        if result is not None:
            checked_result(result, "GraphOfConvexSets.get_graphviz_string")
        path = as_list(active_path, f"GraphOfConvexSets.{label}")
        for edge in path:
            self._check_edge(edge, label)
        chosen = GcsGraphvizOptions() if options is None else options
        wanted = "options must be GcsGraphvizOptions or None"
        _check_kind(chosen, GcsGraphvizOptions, f"get_graphviz_string: {wanted}")
        return graphviz_string(self.vertices, self.edges, result, chosen, path)

    def _by_id(self, flows: Mapping[Edge, float]) -> dict[int, float]:
        """Return flows by the numbers of their edges. Raises ConvexSetError for other edges."""
        given: Iterable[Any] = flows
        for edge in given:
            if not isinstance(edge, Edge) or not self.is_valid(edge):
                raise ConvexSetError(
                    "GraphOfConvexSets.sample_paths: flows must be of this graph's edges, not"
                    f" of {quoted(edge)}"
                )
        return {edge.id: float(flow) for edge, flow in flows.items()}

    def _network(self, source: Vertex, target: Vertex) -> Network:
        """Return all edges by the places of their vertices, kept until there are others."""
        vertices = self._vertices_now()
        if self._ends is None:
            place = {number: k for k, number in enumerate(vertices)}
            ends = [(place[edge.u.id], place[edge.v.id]) for edge in self._edges.now().values()]
            tails, heads = np.array(ends, dtype=np.int64).reshape(-1, 2).T.copy()
            self._ends = place, tails, heads
        place, tails, heads = self._ends
        return Network(len(place), tails, heads, place[source.id], place[target.id])

    def _check_ends(self, u: Any, v: Any, question: str) -> None:
        self._check_vertex(u, f"{question}: u")
        self._check_vertex(v, f"{question}: v")
        if u is v:
            raise ConvexSetError(
                f"GraphOfConvexSets.{question}: u and v are both {u.name!r}; an edge leads"
                " elsewhere"
            )

    def _check_vertex(self, vertex: Any, label: str) -> None:
        if not isinstance(vertex, Vertex) or not self.is_valid(vertex):
            raise ConvexSetError(
                f"GraphOfConvexSets.{label} must be a vertex of this graph, not {quoted(vertex)}"
            )

    def _check_edge(self, edge: Any, label: str) -> None:
        if not isinstance(edge, Edge) or not self.is_valid(edge):
            raise ConvexSetError(
                f"GraphOfConvexSets.{label} must be edges of this graph, not {quoted(edge)}"
            )


def _set_of(name: str) -> str:
    return "GraphOfConvexSets.add_vertex: set" + (f" of {name!r}" if name else "")


def _check_kind(value: Any, kinds: Any, wanted: str) -> None:
    if not isinstance(value, kinds):
        raise ConvexSetError(f"GraphOfConvexSets.{wanted}, not {quoted(value)}")


def _added(table: dict[int, Part], last: int) -> list[Part]:
    """Return the entries with a number above another, which are at the table's end."""
    numbers = itertools.takewhile(lambda number: number > last, reversed(table))
    return [table[number] for number in numbers]
