"""Edges along which the end of one segment is the beginning of the next."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.convex.graphs.expressions.expressions import Constraint
from scene_graph_ros.convex.graphs.expressions.functions import FunctionConstraint
from scene_graph_ros.convex.graphs.expressions.transcription import (
    ALL_TRANSCRIPTIONS,
    Transcription,
)
from scene_graph_ros.convex.graphs.graph import GraphOfConvexSets
from scene_graph_ros.convex.graphs.model.edge import Edge, Vertex
from scene_graph_ros.convex.graphs.model.whole_edits import as_before, Undo, whole_edit, WholeEdits
from scene_graph_ros.convex.questions.arguments import as_whole
from scene_graph_ros.planning.gcs.nonlinear_terms import (
    continue_derivative,
    continue_path_derivative,
)
from scene_graph_ros.planning.gcs.placeholders import (
    control_points,
    duration,
    new_placeholder,
    placed_constraint,
    placed_cost,
)
from scene_graph_ros.planning.gcs.segment_variables import SegmentVariables
from scene_graph_ros.planning.gcs.stops import Tie

__all__ = ["JoinedEdges", "Used"]

Used = Iterable[Transcription] | Transcription
"""In which programs something counts."""


Bounds = tuple[int, np.ndarray, np.ndarray]
"""The order of a derivative, and what it is not below and not above, ``(n,)`` each."""


class JoinedEdges:
    """The common part of edges inside a subgraph and of those between two."""

    def __init__(
        self,
        graph: GraphOfConvexSets,
        whole_edits: WholeEdits,
        first: SegmentVariables,
        second: SegmentVariables,
        name: str,
    ) -> None:
        self._whole_edits = whole_edits
        self._graph, self._first, self._second, self._name = graph, first, second, name
        self._u, self._v = new_placeholder(), new_placeholder()
        self._edges: list[Edge] = []
        self._offsets: dict[int, np.ndarray] = {}
        self._continuity = 0
        self._continuous: set[int] = set()
        self._functions: list[tuple[Edge, int, FunctionConstraint]] = []
        self._has_tied_durations = False
        self._held: dict[int, list[Constraint]] = {}
        """By edges' numbers: equal durations, and what follows where they are."""
        self.has_nonlinear_bounds = False
        """Whether derivatives above the first are bounded."""

    def _undos(self) -> Iterable[Undo]:
        """Return the steps that undo an edit of all edges, or vertices, here."""
        yield as_before(self, vars(self))
        for part in self._parts():
            yield as_before(part, ("_costs", "_constraints"))

    def _parts(self) -> Iterable[Vertex | Edge]:
        """Return the parts that have costs and constraints here."""
        return self._edges

    @property
    def name(self) -> str:
        """The name."""
        return self._name

    @property
    def edges(self) -> list[Edge]:
        """The edges, in the order in which they were added."""
        return list(self._edges)

    @property
    def continuity_order(self) -> int:
        """Up to which order the derivatives of the path r(s) go on along these edges."""
        return self._continuity

    @property
    def most_continuity(self) -> int:
        """The highest order of a derivative that both segments of an edge have."""
        return min(self._first.order, self._second.order)

    def _join(self, u: Vertex, v: Vertex, offset: np.ndarray, turn: np.ndarray) -> Edge:
        """Add an edge whose two segments meet; the first is moved by an offset ``(n,)``.

        ``turn`` ``(n,)`` is that of the subspace in which they meet, if there is one.
        """
        edge = self._graph.add_edge(u, v, f"{u.name} -> {v.name}")
        end = self._first.path(u.id, self._first.order)
        edge.add_constraint(end + offset == self._second.path(v.id, 0))
        self._edges.append(edge)
        self._offsets[edge.id] = offset
        return edge

    def offset_of(self, edge: Edge) -> np.ndarray | None:
        """Return the offset ``(n,)`` of the end of a segment; None for another's edge."""
        return self._offsets.get(edge.id)

    @property
    def meeting_bounds(self) -> tuple[Bounds, ...]:
        """Orders of derivatives of q(t), and their bounds, where segments meet: none."""
        return ()

    @whole_edit
    def add_path_continuity_constraints(self, continuity_order: int) -> None:
        """Ask that derivatives of r(s) of orders from 1 to ``continuity_order`` go on.

        They are those by s in [0, 1], not by time: q(t) goes on in its direction, and its speed
        may change where durations differ; `normalize_segment_times` returns r(s), which goes on in
        full. Raises ConvexSetError for an order below 1 or above that of a segment.
        """
        label = f"{self._name}: add_path_continuity_constraints: continuity_order"
        order = as_whole(continuity_order, label, 1)
        most = self.most_continuity
        if order > most:
            raise ConvexSetError(
                f"{label} must not be above the order of both, {most}, not {order}"
            )
        for derivative in range(self._continuity + 1, order + 1):
            for edge in self._edges:
                continue_path_derivative(edge, self._first, self._second, derivative)
        self._continuity = max(self._continuity, order)
        self._tie_durations()

    @whole_edit
    def add_continuity_constraints(self, continuity_order: int) -> None:
        """Ask that the derivative of q(t) of this order, 1 or above, goes on along these edges.

        For all orders up to k it is to be called with each of 1 to k. Durations make it no convex
        constraint: paths keep it near the points that the relaxation leads to, and the relaxation
        has the same of r(s), the bound has nothing of it. Raises ConvexSetError for an order below
        1 or above that of a segment.

        Where the same derivative of the path r(s) is asked to go on, too, either the durations of
        both segments are the same, or the motion stops where they meet, if that costs less.
        """
        label = f"{self._name}: add_continuity_constraints: continuity_order"
        order = as_whole(continuity_order, label, 1)
        most = self.most_continuity
        if order > most:
            raise ConvexSetError(
                f"{label} must not be above the order of both, {most}, not {order}"
            )
        if order in self._continuous:
            return
        self._continuous.add(order)
        for edge in self._edges:
            if self._has_tied_durations:
                if order > self._continuity:
                    self._hold(edge, order)
            else:
                term = continue_derivative(edge, self._first, self._second, order)
                self._functions.append((edge, order, term))
        self._tie_durations()

    def _tie_durations(self) -> None:
        """Ask for equal durations where a derivative of r(s) and of q(t) both go on.

        They are ``r^(N)`` and ``r^(N) / h^N``, so durations h are the same or the motion stops.
        The two as they are leave the Jacobian without full rank at each solution. With equal
        durations all derivatives of q(t) go on where those of r(s) do, which is linear.
        """
        both = {order for order in self._continuous if order <= self._continuity}
        if self._has_tied_durations or not both:
            return
        self._has_tied_durations = True
        for edge in self._edges:
            for used in (Transcription.RELAXATION, Transcription.RESTRICTION):
                same = self._first.time(edge.u.id) == self._second.time(edge.v.id)
                edge.add_constraint(same, used)
            self._held[edge.id] = [same]
        for edge, order, term in self._functions:
            edge.discard_constraint(term)
            if order > self._continuity:
                self._hold(edge, order)

    def _hold(self, edge: Edge, order: int) -> None:
        """Have a derivative of r(s) go on where durations are equal."""
        ends = self._first, self._second
        for used in (Transcription.RELAXATION, Transcription.RESTRICTION):
            held = continue_path_derivative(edge, *ends, order, used)
        self._held[edge.id].append(held)

    def ties(self) -> list[Tie]:
        """Return the ties of durations; see `stops`."""
        return [self._tie(edge) for edge in self._edges if edge.id in self._held]

    def _tie(self, edge: Edge) -> Tie:
        stopped = [
            segment.path(key, index, order) == 0.0
            for order in sorted(self._continuous)
            for segment, index, key in (
                (self._first, self._first.order - order, edge.u.id),
                (self._second, 0, edge.v.id),
            )
        ]
        return Tie(edge, tuple(self._held[edge.id]), tuple(stopped))

    @property
    def continuous_derivatives(self) -> list[int]:
        """The orders of the derivatives of q(t) that were asked to go on."""
        return sorted(self._continuous)

    # What a user adds.

    def edge_constituent_vertex_control_points(self) -> tuple[tuple[Any, ...], tuple[Any, ...]]:
        """Return the control points of the segments before and after an edge, ``(n,)`` each.

        They stand for those of every edge here, in `add_edge_cost` and `add_edge_constraint`.
        """
        return control_points(self._first, self._u), control_points(self._second, self._v)

    def edge_constituent_vertex_durations(self) -> tuple[Any, Any]:
        """Return the durations of both segments. Raises ConvexSetError where one has none."""
        label = f"{self._name}: edge_constituent_vertex_durations"
        return duration(self._first, self._u, label), duration(self._second, self._v, label)

    @whole_edit
    def add_edge_cost(self, cost: Any, use_in_transcription: Used = ALL_TRANSCRIPTIONS) -> None:
        """Add a cost to each edge, of `edge_constituent_vertex_control_points` and durations.

        ``use_in_transcription`` says in which programs it counts, as for edges of all graphs.
        """
        label = f"{self._name}: add_edge_cost: cost"
        placed_cost(cost, {self._u: 0, self._v: 0}, label)  # refused without edges, too
        for edge in self._edges:
            meant = {self._u: edge.u.id, self._v: edge.v.id}
            edge.add_cost(placed_cost(cost, meant, label), use_in_transcription)

    @whole_edit
    def add_edge_constraint(
        self, constraint: Any, use_in_transcription: Used = ALL_TRANSCRIPTIONS
    ) -> None:
        """Add a convex constraint to each edge, of the same expressions."""
        label = f"{self._name}: add_edge_constraint: constraint"
        placed_constraint(constraint, {self._u: 0, self._v: 0}, label)  # as above
        for edge in self._edges:
            meant = {self._u: edge.u.id, self._v: edge.v.id}
            edge.add_constraint(placed_constraint(constraint, meant, label), use_in_transcription)
