"""Vertices and edges of graphs of convex sets."""

from __future__ import annotations

import functools
from typing import Any, TYPE_CHECKING

import numpy as np

from scene_graph_ros.geometry.optimization.errors import ConvexSetError
from scene_graph_ros.geometry.optimization.graphs.expressions import (
    Affine,
    as_cost,
    Constraint,
    Cost,
)
from scene_graph_ros.geometry.optimization.graphs.placed_set import PlacedSet
from scene_graph_ros.geometry.optimization.sets.convex_set import ConvexSet
from scene_graph_ros.geometry.quoting import quoted

if TYPE_CHECKING:
    from scene_graph_ros.geometry.optimization.graphs.result import GraphOfConvexSetsResult

__all__ = ["Edge", "Vertex"]


class _Costly:
    """What has costs and constraints of the points of some vertices."""

    def __init__(self, number: int, name: str, label: str) -> None:
        self._id, self._name, self._label = number, name, label
        self._costs: list[Cost] = []
        self._constraints: list[Constraint] = []

    def __repr__(self) -> str:
        return f"<{self._label} {self._name!r}>"

    @property
    def id(self) -> int:
        """The number of this in its graph."""
        return self._id

    @property
    def name(self) -> str:
        """The name."""
        return self._name

    def _own(self) -> dict[int, str]:
        raise NotImplementedError

    def _check(self, of: Affine, question: str) -> None:
        own = self._own()
        for number in of.terms:
            if number not in own:
                raise ConvexSetError(
                    f"{self._label}.{question}: the expression has the point of vertex {number};"
                    f" only {' and '.join(own.values())} may be in it"
                )

    def add_cost(self, cost: Any) -> Cost:
        """Add a number, an affine number or a convex expression; it is returned.

        What is affine must be at least 0 on all of the sets, which is checked when a path is
        asked for. Raises ConvexSetError for an expression of other vertices, or of more than one
        entry.
        """
        checked = as_cost(cost, f"{self._label}.add_cost: cost of {self._name!r}")
        for part in (checked.rest, *(atom.of for atom in checked.atoms)):
            self._check(part, "add_cost")
        self._costs.append(checked)
        return checked

    def add_constraint(self, constraint: Constraint) -> Constraint:
        """Add a linear equation or inequality, as ``edge.xu == edge.xv``; it is returned.

        Raises ConvexSetError for what is no constraint, or has the points of other vertices.
        """
        if not isinstance(constraint, Constraint):
            raise ConvexSetError(
                f"{self._label}.add_constraint: constraint of {self._name!r} must be made by ==,"
                f" <= or >= of an expression, not {quoted(constraint)}"
            )
        self._check(constraint.rows, "add_constraint")
        self._constraints.append(constraint)
        return constraint

    def get_costs(self) -> list[Cost]:
        """Return the costs that were added."""
        return list(self._costs)

    def get_constraints(self) -> list[Constraint]:
        """Return the constraints that were added."""
        return list(self._constraints)


class Vertex(_Costly):
    """A convex set of a graph."""

    def __init__(self, number: int, set: ConvexSet, name: str) -> None:  # noqa: A002
        super().__init__(number, name, "Vertex")
        self._set = set
        self._incoming: list[Edge] = []
        self._outgoing: list[Edge] = []

    @property
    def set(self) -> ConvexSet:
        """The set."""
        return self._set

    @functools.cached_property
    def placed(self) -> PlacedSet:
        """The set about its own centre, kept."""
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
        return list(self._incoming)

    @property
    def outgoing_edges(self) -> list[Edge]:
        """The edges that lead from here."""
        return list(self._outgoing)

    def _own(self) -> dict[int, str]:
        return {self.id: "vertex.x"}

    def get_solution(self, result: GraphOfConvexSetsResult) -> np.ndarray | None:
        """Return the point ``(n,)`` of a result; None where its path doesn't visit the set.

        Of a relaxation without a path, the mean of the points of all edges here by their flows.
        """
        if result.is_success:
            if self.id not in result.vertices:
                return None
            return result.points[result.vertices.index(self.id)]
        edges = [(e, result.phi_xv) for e in self._incoming] or [
            (e, result.phi_xu) for e in self._outgoing
        ]
        known = [(e.id, at[e.id]) for e, at in edges if e.id in at]
        flow = sum(result.flows[number] for number, _ in known)
        if flow <= 1e-6:
            return None
        return np.sum([point for _, point in known], axis=0) / flow


class Edge(_Costly):
    """A way from the point of one set to the point of another."""

    def __init__(self, number: int, u: Vertex, v: Vertex, name: str) -> None:
        super().__init__(number, name, "Edge")
        self._u, self._v = u, v
        self._phi: set[bool] = set()

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

    def add_phi_constraint(self, phi_value: bool) -> None:
        """Ask that the edge is on the path, or that it is not."""
        if not isinstance(phi_value, bool):
            raise ConvexSetError(
                "Edge.add_phi_constraint: phi_value must be True or False, not"
                f" {quoted(phi_value)}"
            )
        self._phi.add(phi_value)

    def clear_phi_constraints(self) -> None:
        """Allow both again."""
        self._phi.clear()

    @property
    def phi_constraints(self) -> frozenset[bool]:
        """What was asked by `add_phi_constraint`."""
        return frozenset(self._phi)

    def get_solution_phi(self, result: GraphOfConvexSetsResult) -> float | None:
        """Return the flow of a result's relaxation; None where the edge was left out."""
        return result.flows.get(self.id)

    def get_solution_phi_xu(self, result: GraphOfConvexSetsResult) -> np.ndarray | None:
        """Return the flow times the point of ``u``; None where the edge was left out."""
        return result.phi_xu.get(self.id)

    def get_solution_phi_xv(self, result: GraphOfConvexSetsResult) -> np.ndarray | None:
        """Return the flow times the point of ``v``; None where the edge was left out."""
        return result.phi_xv.get(self.id)

    def get_solution_cost(self, result: GraphOfConvexSetsResult) -> float | None:
        """Return what the edge costs on a result's path; None where it is not on it."""
        return result.edge_costs.get(self.id)
