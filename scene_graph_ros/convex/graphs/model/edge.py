"""Vertices and edges of graphs of convex sets."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
import functools
from typing import Any, ClassVar, TYPE_CHECKING

import numpy as np

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.convex.graphs.expressions.expressions import (
    Affine,
    as_cost,
    Constraint,
)
from scene_graph_ros.convex.graphs.expressions.functions import (
    FunctionConstraint,
    FunctionCost,
)
from scene_graph_ros.convex.graphs.expressions.transcription import (
    ALL_TRANSCRIPTIONS,
    as_transcriptions,
    Transcription,
)
from scene_graph_ros.convex.graphs.model.checked_result import checked_result
from scene_graph_ros.convex.graphs.model.edge_table import EdgeTable
from scene_graph_ros.convex.graphs.model.edge_terms import EdgeTerms
from scene_graph_ros.convex.graphs.model.placed_set import PlacedSet
from scene_graph_ros.convex.graphs.model.term_copies import renumbered
from scene_graph_ros.convex.sets.convex_set import ConvexSet
from scene_graph_ros.geometry.one_line import cut
from scene_graph_ros.geometry.quoting import quoted

if TYPE_CHECKING:
    from scene_graph_ros.convex.graphs.search.result import GraphOfConvexSetsResult

__all__ = ["Edge", "Vertex"]


_NO_FLOW = 1e-9
"""A flow that is the solver's rounding: it costs nothing."""


class _Costly:
    """An object with costs and constraints of the points of some vertices."""

    _label: ClassVar[str]

    def __init__(self, number: int, name: str) -> None:
        self._id, self._name = number, name
        self._costs: list[tuple[Any, frozenset[Transcription]]] = []
        self._constraints: list[tuple[Any, frozenset[Transcription]]] = []
        self._changes = 0

    def __repr__(self) -> str:
        return cut(f"<{self._label} {self._name!r}>")

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

    def add_cost(
        self,
        cost: Any,
        use_in_transcription: Iterable[Transcription] | Transcription = ALL_TRANSCRIPTIONS,
    ) -> Any:
        """Add a number, an affine number or a convex expression; it is returned.

        An affine cost must be at least 0 on all of the sets, which is checked when a path is
        asked for. For the restriction alone also a function of the points, of ``xu`` and ``xv`` of
        an edge or ``x`` of a vertex, that returns a number and need not be convex. Raises
        ConvexSetError for an expression of other vertices, or of more than one entry.
        """
        label = f"{self._label}.add_cost: cost of {self._name!r}"
        used = as_transcriptions(use_in_transcription, f"{label}: use_in_transcription")
        if callable(cost) or isinstance(cost, FunctionCost):
            self._check_function(used, label)
            function = cost if isinstance(cost, FunctionCost) else FunctionCost(cost)
            self._changes += 1
            self._costs.append((function, used))
            return function
        checked = as_cost(cost, label)
        for part in (checked.rest, *(atom.of for atom in checked.atoms)):
            self._check(part, "add_cost")
        self._changes += 1
        self._costs.append((checked, used))
        return checked

    def add_constraint(
        self,
        constraint: Any,
        use_in_transcription: Iterable[Transcription] | Transcription = ALL_TRANSCRIPTIONS,
    ) -> Any:
        """Add an equation or inequality, as ``edge.xu == edge.xv``; it is returned.

        Linear ones, ``norm(...) <= ...`` and ``sum_squares(...) <= ...``; for the restriction
        alone also a `FunctionConstraint`, which need not be convex. Raises ConvexSetError for an
        object that is no constraint, or has the points of other vertices.
        """
        label = f"{self._label}.add_constraint: constraint of {self._name!r}"
        used = as_transcriptions(use_in_transcription, f"{label}: use_in_transcription")
        if isinstance(constraint, FunctionConstraint):
            self._check_function(used, label)
        elif isinstance(constraint, Constraint):
            self._check(constraint.rows, "add_constraint")
        else:
            raise ConvexSetError(
                f"{label} must be made by ==, <= or >= of an expression, or be a"
                f" FunctionConstraint, not {quoted(constraint)}"
            )
        self._changes += 1
        self._constraints.append((constraint, used))
        return constraint

    def _take_terms(self, template: _Costly, numbers: Mapping[int, int]) -> None:
        """Take the costs and constraints of another, of vertices with other numbers."""
        self._changes += 1
        self._costs += [(renumbered(term, numbers), used) for term, used in template._costs]
        self._constraints += [
            (renumbered(term, numbers), used) for term, used in template._constraints
        ]

    def discard_constraint(self, constraint: Any) -> None:
        """Take back a constraint that `add_constraint` returned; others that equal it stay."""
        self._changes += 1
        self._constraints = [each for each in self._constraints if each[0] is not constraint]

    @property
    def has_functions(self) -> bool:
        """Whether a cost or a constraint is a function, of which the restriction alone knows."""
        terms = (*self._costs, *self._constraints)
        return any(isinstance(term, (FunctionCost, FunctionConstraint)) for term, _ in terms)

    @staticmethod
    def _check_function(used: frozenset[Transcription], label: str) -> None:
        if used != {Transcription.RESTRICTION}:
            raise ConvexSetError(
                f"{label} is a function, which has no relaxation: say use_in_transcription="
                "{Transcription.RESTRICTION}, and add a convex one for the others"
            )

    def get_costs(
        self,
        used_in_transcription: Iterable[Transcription] | Transcription = ALL_TRANSCRIPTIONS,
    ) -> list[Any]:
        """Return the costs that were added and count in one of some transcriptions."""
        return _used(self._costs, used_in_transcription, f"{self._label}.get_costs")

    def get_constraints(
        self,
        used_in_transcription: Iterable[Transcription] | Transcription = ALL_TRANSCRIPTIONS,
    ) -> list[Any]:
        """Return the constraints that were added and count in one of some transcriptions."""
        return _used(self._constraints, used_in_transcription, f"{self._label}.get_constraints")

    @property
    def num_changes(self) -> int:
        """How often a cost or constraint was added or taken back."""
        return self._changes

    @property
    def transcriptions(self) -> set[frozenset[Transcription]]:
        """Which sets of transcriptions its costs and constraints count in."""
        return {used for _, used in (*self._costs, *self._constraints)}

    def _cost_at(self, cost: Any, points: dict[int, np.ndarray]) -> float:
        """Return one of its costs at points by numbers of vertices."""
        return float(
            cost.at(points, list(self._own()))
            if isinstance(cost, FunctionCost)
            else cost.at(points)
        )

    def cost_at(self, costs: Sequence[Any], points: dict[int, np.ndarray]) -> float:
        """Return the sum of some of its costs at points ``(n,)`` by numbers of vertices."""
        return sum((self._cost_at(cost, points) for cost in costs), 0.0)

    def _solution_cost(
        self, result: GraphOfConvexSetsResult, cost: Any, default: float | None
    ) -> float | None:
        """Return the total cost in a result, or the cost of one term. Raises ConvexSetError."""
        if cost is not None and not any(cost is each for each, _ in self._costs):
            raise ConvexSetError(
                f"{self._label}.get_solution_cost: cost must be one of {self._name!r}, not"
                f" {quoted(cost)}"
            )
        if not result.is_success and result.flows:
            used = [cost] if cost is not None else self.get_costs(result.transcription)
            shares = self._shares(result)
            if not shares:
                return None
            return sum(
                (flow * self._cost_at(c, at) for flow, at in shares if flow for c in used), 0.0
            )
        if cost is None or default is None:
            return default
        points = dict(zip(result.vertices, result.points, strict=True))
        return self._cost_at(cost, points)

    def _shares(
        self, result: GraphOfConvexSetsResult
    ) -> list[tuple[float, dict[int, np.ndarray]]]:
        """Return flows of a relaxation that count here, with the points that they go through."""
        raise NotImplementedError


def _used(terms: list[tuple[Any, frozenset[Transcription]]], asked: Any, label: str) -> list[Any]:
    some = as_transcriptions(asked, f"{label}: used_in_transcription")
    return [each for each, used in terms if used & some]


class Vertex(_Costly):
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


class Edge(_Costly):
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
        self._terms: dict[tuple[int, ...], EdgeTerms] = {}

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

    def kept_terms(self, used: Transcription, is_first: bool) -> EdgeTerms | None:
        """Return the terms of `keep_terms`; None where costs or constraints were added since."""
        return self._terms.get(self._moment(used, is_first))

    def keep_terms(self, used: Transcription, is_first: bool, terms: EdgeTerms) -> None:
        """Keep the edge's terms in a transcription, with those of the vertex it leads to.

        And with the one it leads from, where it is the first of paths.
        """
        moment = self._moment(used, is_first)
        self._terms = {k: each for k, each in self._terms.items() if k[2:] == moment[2:]}
        self._terms[moment] = terms

    def _moment(self, used: Transcription, is_first: bool) -> tuple[int, ...]:
        changes = self._changes, self._v.num_changes, self._u.num_changes
        return (int(used), int(is_first), *changes)

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
        return [(flow, at)]

    def get_solution_cost(self, result: GraphOfConvexSetsResult, cost: Any = None) -> float | None:
        """Return the cost of the edge, or of one of its terms, on a result's path; None beside it.

        Of a relaxation without a path, the cost of its flow: the perspective of the cost.
        """
        costs = checked_result(result, "Edge.get_solution_cost").edge_costs
        return self._solution_cost(result, cost, costs.get(self.id))
