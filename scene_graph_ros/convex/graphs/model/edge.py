"""Vertices and edges of graphs of convex sets."""

from __future__ import annotations

import functools
from typing import Any, TYPE_CHECKING

import numpy as np

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.convex.graphs.expressions.expressions import (
    Affine,
)
from scene_graph_ros.convex.graphs.expressions.transcription import (
    Transcription,
)
from scene_graph_ros.convex.graphs.model.checked_result import checked_result
from scene_graph_ros.convex.graphs.model.costly import Costly
from scene_graph_ros.convex.graphs.model.edge_table import EdgeTable
from scene_graph_ros.convex.graphs.model.edge_terms import EdgeTerms
from scene_graph_ros.convex.graphs.model.placed_set import PlacedSet
from scene_graph_ros.convex.sets.convex_set import ConvexSet
from scene_graph_ros.geometry.quoting import quoted

if TYPE_CHECKING:
    from scene_graph_ros.convex.graphs.search.result import GraphOfConvexSetsResult

__all__ = ["Edge", "Vertex"]


_NO_FLOW = 1e-9
"""A flow that is the solver's rounding: it costs nothing."""


_MOST_KEPT = 16
"""Terms that an edge keeps, of costs and constraints that it had."""

_Moment = tuple[int, bool, int, int, int, int, tuple[tuple[int, frozenset[Transcription]], ...]]
"""Transcription, whether it is a first edge, changes of its vertices, and its own expressions."""


class Vertex(Costly):
    """A convex set of a graph."""

    _label = "Vertex"

    def __init__(
        self,
        number: int,
        set: ConvexSet,  # noqa: A002
        name: str,
        of_graph: EdgeTable[Edge] | None = None,
    ) -> None:
        """Take the edges of the graph, if it is of one: others are none of the vertex."""
        super().__init__(number, name)
        self._set = set
        self._of_graph = EdgeTable() if of_graph is None else of_graph
        self._incoming: dict[int, Edge] = {}
        self._outgoing: dict[int, Edge] = {}

    @property
    def set(self) -> ConvexSet:
        """The set."""
        return self._set

    @functools.cached_property
    def is_bounded(self) -> bool:
        """Whether the set is, kept."""
        return self._set.is_bounded()

    @functools.cached_property
    def placed(self) -> PlacedSet:
        """The set about its own centre, kept. Raises ConvexSetError for an unbounded one."""
        if not self.is_bounded:
            raise ConvexSetError(
                f"{self._label}: the set of {self.name!r}, {quoted(self._set)}, is unbounded;"
                " intersect it with a box"
            )
        return PlacedSet.place(self._set)

    @property
    def ambient_dimension(self) -> int:
        """The number of coordinates of its points."""
        return self._set.ambient_dimension

    @property
    def x(self) -> Affine:
        """The point ``(n,)`` where a path visits the set, as an expression."""
        n = self.ambient_dimension
        return Affine({self.id: np.eye(n)}, np.zeros(n))

    @property
    def incoming_edges(self) -> list[Edge]:
        """The edges that lead here."""
        return self._of_graph.those_of(self._incoming)

    @property
    def outgoing_edges(self) -> list[Edge]:
        """The edges that lead from here."""
        return self._of_graph.those_of(self._outgoing)

    def _own(self) -> dict[int, str]:
        return {self.id: "vertex.x"}

    def _next_number(self) -> int:
        return next(self._of_graph.numbers)

    def _shares(
        self, result: GraphOfConvexSetsResult
    ) -> list[tuple[float, dict[int, np.ndarray]]]:
        # With the edges that lead here, and at the source with those that lead on.
        sides = [
            [share for edge in edges for share in edge._shares(result)]
            for edges in (self.incoming_edges, self.outgoing_edges)
        ]
        return max(sides, key=lambda side: sum(flow for flow, _ in side))

    def get_solution_cost(self, result: GraphOfConvexSetsResult, cost: Any = None) -> float | None:
        """Return the cost of the vertex, or of one of its terms, on a path; None beside it.

        Of a relaxation without a path, the cost of all flows through it.
        """
        costs = checked_result(result, "Vertex.get_solution_cost").vertex_costs
        return self._solution_cost(result, cost, costs.get(self.id))

    def get_solution(self, result: GraphOfConvexSetsResult) -> np.ndarray | None:
        """Return the point ``(n,)`` of a result; None where its path doesn't visit the set.

        Of a relaxation without a path, the mean of the points of all edges here by their flows.
        """
        if checked_result(result, "Vertex.get_solution").is_success:
            if self.id not in result.vertices:
                return None
            return result.points[result.vertices.index(self.id)]
        edges = [(e, result.phi_xv) for e in self.incoming_edges] or [
            (e, result.phi_xu) for e in self.outgoing_edges
        ]
        known = [(e.id, at[e.id]) for e, at in edges if e.id in at]
        flow = sum(result.flows[number] for number, _ in known)
        if flow <= 1e-6:
            return None
        return np.sum([point for _, point in known], axis=0) / flow


class Edge(Costly):
    """A way from the point of one set to the point of another."""

    _label = "Edge"

    def __init__(
        self,
        number: int,
        u: Vertex,
        v: Vertex,
        name: str,
        phi: dict[int, frozenset[bool]] | None = None,
    ) -> None:
        """Take the graph's table of constraints on all its edges, by their numbers."""
        super().__init__(number, name)
        self._u, self._v = u, v
        self._phi = {} if phi is None else phi
        self._terms: dict[_Moment, tuple[tuple[Any, ...], EdgeTerms]] = {}

    @property
    def u(self) -> Vertex:
        """The vertex that the edge leads from."""
        return self._u

    @property
    def v(self) -> Vertex:
        """The vertex that the edge leads to."""
        return self._v

    @property
    def xu(self) -> Affine:
        """The point of ``u``, as an expression."""
        return self._u.x

    @property
    def xv(self) -> Affine:
        """The point of ``v``, as an expression."""
        return self._v.x

    def _own(self) -> dict[int, str]:
        return {self._u.id: "edge.xu", self._v.id: "edge.xv"}

    def _next_number(self) -> int:
        return self._u._next_number()

    def kept_terms(self, used: Transcription, is_first: bool) -> EdgeTerms | None:
        """Return the terms of `keep_terms` for its costs and constraints now; None without any."""
        found = self._terms.get(self._moment(used, is_first))
        return None if found is None else found[1]

    def keep_terms(self, used: Transcription, is_first: bool, terms: EdgeTerms) -> None:
        """Keep the edge's terms in a transcription, with those of the vertex it leads to.

        And with the one it leads from, where it is the first of paths. They are known once more
        when a constraint that was taken back is added again.
        """
        moment = self._moment(used, is_first)
        vertices = moment[2:4]
        kept = {k: each for k, each in self._terms.items() if k[2:4] == vertices}
        for oldest in list(kept)[: max(len(kept) + 1 - _MOST_KEPT, 0)]:
            del kept[oldest]
        # The expressions live on beside their numbers, so that no others get these.
        own = tuple(term for term, _ in (*self._costs, *self._constraints))
        self._terms = {**kept, moment: (own, terms)}

    def _moment(self, used: Transcription, is_first: bool) -> _Moment:
        own = tuple((id(term), of) for term, of in (*self._costs, *self._constraints))
        vertices = self._v.num_changes, self._u.num_changes
        return (int(used), is_first, *vertices, len(self._slack), len(self._costs), own)

    def add_phi_constraint(self, phi_value: bool) -> None:
        """Ask that the edge is on the path, or that it is not."""
        if not isinstance(phi_value, bool):
            raise ConvexSetError(
                "Edge.add_phi_constraint: phi_value must be True or False, not"
                f" {quoted(phi_value)}"
            )
        self._phi[self.id] = self.phi_constraints | {phi_value}

    def clear_phi_constraints(self) -> None:
        """Allow both again."""
        self._phi.pop(self.id, None)

    @property
    def has_phi_constraints(self) -> bool:
        """Whether it has to be on the path, or must not."""
        return bool(self.phi_constraints)

    @property
    def phi_constraints(self) -> frozenset[bool]:
        """The constraint of `add_phi_constraint`."""
        return self._phi.get(self.id, frozenset())

    def get_solution_phi(self, result: GraphOfConvexSetsResult) -> float | None:
        """Return the flow of a result's relaxation; None where the edge was left out."""
        return checked_result(result, "Edge.get_solution_phi").flows.get(self.id)

    def get_solution_phi_xu(self, result: GraphOfConvexSetsResult) -> np.ndarray | None:
        """Return the flow times the point of ``u``; None where the edge was left out."""
        return checked_result(result, "Edge.get_solution_phi_xu").phi_xu.get(self.id)

    def get_solution_phi_xv(self, result: GraphOfConvexSetsResult) -> np.ndarray | None:
        """Return the flow times the point of ``v``; None where the edge was left out."""
        return checked_result(result, "Edge.get_solution_phi_xv").phi_xv.get(self.id)

    def _shares(
        self, result: GraphOfConvexSetsResult
    ) -> list[tuple[float, dict[int, np.ndarray]]]:
        flow = result.flows.get(self.id)
        if flow is None or not flow > _NO_FLOW:
            return [] if flow is None else [(0.0, {})]
        at = {self._u.id: result.phi_xu[self.id] / flow, self._v.id: result.phi_xv[self.id] / flow}
        slack = result.phi_slack_variables.get(self.id, {})
        return [(flow, at | {number: s / flow for number, s in slack.items()})]

    def get_solution_cost(self, result: GraphOfConvexSetsResult, cost: Any = None) -> float | None:
        """Return the cost of the edge, or of one of its terms, on a result's path; None beside it.

        Of a relaxation without a path, the cost of its flow: the perspective of the cost.
        """
        costs = checked_result(result, "Edge.get_solution_cost").edge_costs
        return self._solution_cost(result, cost, costs.get(self.id))
