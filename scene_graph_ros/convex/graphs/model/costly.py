"""Costs and constraints of the points of some vertices: those of a vertex, or of an edge."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
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
from scene_graph_ros.convex.graphs.model.term_copies import renumbered
from scene_graph_ros.geometry.one_line import cut
from scene_graph_ros.geometry.quoting import quoted

if TYPE_CHECKING:
    from scene_graph_ros.convex.graphs.search.result import GraphOfConvexSetsResult

__all__ = ["Costly"]


class Costly:
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

    def _take_terms(self, template: Costly, numbers: Mapping[int, int]) -> None:
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
