"""Edges from the regions of one mode to those of another."""

from __future__ import annotations

from typing import Any

import numpy as np

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.convex.graphs.graph import GraphOfConvexSets
from scene_graph_ros.convex.graphs.model.edge import Edge, Vertex
from scene_graph_ros.convex.graphs.model.whole_edits import whole_edit, WholeEdits
from scene_graph_ros.convex.questions.arguments import as_whole
from scene_graph_ros.convex.sets.convex_set import ConvexSet
from scene_graph_ros.convex.sets.h_polyhedron import HPolyhedron
from scene_graph_ros.convex.sets.hyperrectangle import Hyperrectangle
from scene_graph_ros.convex.sets.point import Point
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.planning.gcs.arguments import as_bounds
from scene_graph_ros.planning.gcs.joined_edges import Bounds, JoinedEdges
from scene_graph_ros.planning.gcs.nonlinear_terms import bound_derivative
from scene_graph_ros.planning.gcs.subgraph import Subgraph

__all__ = ["EdgesBetweenSubgraphs"]


@one_line("name")
class EdgesBetweenSubgraphs(JoinedEdges):
    """Ways from the regions of one subgraph to those of another; made by `add_edges`."""

    def __init__(
        self,
        graph: GraphOfConvexSets,
        whole_edits: WholeEdits,
        from_subgraph: Subgraph,
        to_subgraph: Subgraph,
        subspace: ConvexSet | None,
    ) -> None:
        name = f"{from_subgraph.name} -> {to_subgraph.name}"
        super().__init__(graph, whole_edits, from_subgraph.variables, to_subgraph.variables, name)
        self._from, self._to = from_subgraph, to_subgraph
        self._subspace = _as_rows(subspace, name)
        self._bounds: list[Bounds] = []

    @property
    def from_subgraph(self) -> Subgraph:
        """Where the edges begin."""
        return self._from

    @property
    def to_subgraph(self) -> Subgraph:
        """Where they end."""
        return self._to

    @property
    def meeting_bounds(self) -> tuple[Bounds, ...]:
        """Orders of derivatives of q(t), and their bounds ``(n,)``, where segments meet here.

        Order 1 is the velocity; bounds are 0 and 0 where a derivative is to be zero.
        """
        return tuple(self._bounds)

    def _join(self, u: Vertex, v: Vertex, offset: np.ndarray, turn: np.ndarray) -> Edge:
        edge = super()._join(u, v, offset, turn)
        if self._subspace is not None:
            A, b, is_equation = self._subspace
            at = self._second.path(v.id, 0) - turn
            edge.add_constraint(A @ at == b if is_equation else A @ at <= b)
        return edge

    @whole_edit
    def add_velocity_bounds(self, lb: Any, ub: Any) -> None:
        """Ask for ``lb <= dq/dt <= ub`` ``(n,)`` where the two segments meet, of both.

        An infinite bound is none. Raises ConvexSetError where both are of order 0.
        """
        label = f"{self._name}: add_velocity_bounds"
        low, high = as_bounds(lb, ub, self._first.num_positions, label)
        self._check_order(1, label)
        for edge in self._edges:
            for segment, index, key in self._ends(edge, 1):
                rate, h = segment.path(key, index, 1), segment.time(key)
                for keep, bound, sign in ((high < np.inf, high, 1.0), (low > -np.inf, low, -1.0)):
                    if keep.any():
                        rows = np.flatnonzero(keep)
                        edge.add_constraint(sign * rate[rows] <= (sign * bound[rows])[:, None] @ h)
        self._bounds.append((1, low, high))

    @whole_edit
    def add_nonlinear_derivative_bounds(self, lb: Any, ub: Any, derivative_order: int) -> None:
        """Ask for ``lb <= q^(N) <= ub`` ``(n,)`` where the two segments meet, of both.

        See `Subgraph.add_nonlinear_derivative_bounds`. Raises ConvexSetError for an order below 2,
        or above that of both.
        """
        label = f"{self._name}: add_nonlinear_derivative_bounds"
        low, high = as_bounds(lb, ub, self._first.num_positions, label)
        order = as_whole(derivative_order, f"{label}: derivative_order", 2)
        self._check_order(order, label)
        for edge in self._edges:
            for segment, index, key in self._ends(edge, order):
                bound_derivative(edge, (segment, (index,), key), low, high, order)
        self._bounds.append((order, low, high))
        self.has_nonlinear_bounds = True

    @whole_edit
    def add_zero_derivative_constraints(self, derivative_order: int) -> None:
        """Ask that a derivative of q(t) is 0 where the two segments meet, of both.

        Raises ConvexSetError for an order below 1, or above that of both.
        """
        label = f"{self._name}: add_zero_derivative_constraints: derivative_order"
        order = as_whole(derivative_order, label, 1)
        self._check_order(order, label)
        for edge in self._edges:
            for segment, index, key in self._ends(edge, order):
                edge.add_constraint(segment.path(key, index, order) == 0.0)
        zero = np.zeros(self._first.num_positions)
        self._bounds.append((order, zero, zero))

    def _check_order(self, order: int, label: str) -> None:
        most = max(self._first.order, self._second.order)
        if order > most:
            raise ConvexSetError(
                f"{label}: a derivative of order {order} is none of segments of order {most}"
            )

    def _ends(self, edge: Edge, order: int) -> list[tuple[Any, int, int]]:
        """Return the variables of a derivative at an edge: of both segments that have one."""
        ends = [(self._first, self._first.order - order, edge.u.id), (self._second, 0, edge.v.id)]
        return [end for end in ends if end[0].order >= order]


def _as_rows(subspace: ConvexSet | None, name: str) -> tuple[np.ndarray, np.ndarray, bool] | None:
    """Return a subspace as rows ``A``, sides ``b``, and whether they are equations."""
    if subspace is None:
        return None
    if isinstance(subspace, Point):
        return np.eye(subspace.ambient_dimension), subspace.x, True
    if isinstance(subspace, Hyperrectangle):
        subspace = subspace.make_h_polyhedron()
    if isinstance(subspace, HPolyhedron):
        return subspace.A, subspace.b, False
    raise ConvexSetError(
        f"{name}: add_edges: subspace must be a Point, Hyperrectangle or HPolyhedron, not"
        f" {quoted(subspace)}; put it between as regions of order 0"
    )
