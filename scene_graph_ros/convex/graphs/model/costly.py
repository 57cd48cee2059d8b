"""Costs and constraints of the points of some vertices: those of a vertex, or of an edge."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, ClassVar, TYPE_CHECKING

import numpy as np

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.convex.graphs.expressions.expressions import (
    Affine,
    as_cost,
    Constraint,
    Cost,
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
from scene_graph_ros.convex.graphs.model.slack_variables import SlackVariables
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
        self._slack: list[SlackVariables] = []
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
        """Return the names of the points that may be in its terms, by numbers of vertices."""
        raise NotImplementedError

    def _next_number(self) -> int:
        """Return a number that the graph has not given out."""
        raise NotImplementedError

    def _check(self, of: Affine, question: str) -> None:
        own, slack = self._own(), {each.number for each in self._slack}
        for number in of.terms:
            if number not in own and number not in slack:
                names = [*own.values(), *(["slack variables of its own"] if slack else [])]
                raise ConvexSetError(
                    f"{self._label}.{question}: the expression has the point of vertex {number},"
                    f" or slack variables of that number; only {' and '.join(names)} may be in it"
                )

    def new_slack_variables(
        self,
        rows: int,
        name: str = "",
        lower_bound: Any = -np.inf,
        upper_bound: Any = np.inf,
    ) -> Affine:
        """Return ``rows`` more variables, for costs and constraints of this one alone.

        They are no part of a point: a path's points and these are chosen together, wherever the
        path goes along or through this one. Bounds are numbers or ``(rows,)``; without these,
        costs and constraints have to bound the variables. An affine cost that has some counts
        as 0 where it is less. Functions take all of them, one array
        ``(k,)`` in the order in which they were made, behind the points. Raises ConvexSetError.
        """
        label = f"{self._label}.new_slack_variables of {self._name!r}"
        made = SlackVariables.make(
            label, self._next_number(), rows, name, lower_bound, upper_bound
        )
        self._changes += 1
        self._slack.append(made)
        return made.expression

    @property
    def slack_variables(self) -> list[Affine]:
        """The expressions that `new_slack_variables` returned, in their order."""
        return [each.expression for each in self._slack]

    @property
    def last_number(self) -> int:
        """The largest number that is given to this or to its slack variables."""
        return max([self._id, *(each.number for each in self._slack)])

    def get_solution_slack_variables(self, result: GraphOfConvexSetsResult) -> np.ndarray | None:
        """Return the values ``(k,)`` of all slack variables in a result; None beside its path.

        Of a relaxation without a path, the mean of those of all its flows.
        """
        label = f"{self._label}.get_solution_slack_variables"
        values = checked_result(result, label).slack_variables
        numbers = [each.number for each in self._slack]
        if not result.is_success and result.flows:
            shares = [(flow, at) for flow, at in self._shares(result) if flow > 0.0]
            total = sum(flow for flow, _ in shares)
            if not shares:
                return None
            sums = [sum(flow * at[number] for flow, at in shares) / total for number in numbers]
            return np.concatenate([np.zeros(0), *sums])
        if any(number not in values for number in numbers):
            return None
        return np.concatenate([np.zeros(0), *(values[number] for number in numbers)])

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

    def _take_terms(self, template: Costly, numbers: Mapping[int, int] | None = None) -> None:
        """Take the costs, constraints and slack variables of another.

        Of vertices with other ``numbers``, and then slack variables have new ones, too.
        """
        self._changes += 1
        self._slack = list(template._slack)
        if numbers is None:
            numbers = {}
        else:
            self._slack = [replace(s, number=self._next_number()) for s in template._slack]
            pairs = zip(template._slack, self._slack, strict=True)
            numbers = {**numbers, **{old.number: new.number for old, new in pairs}}
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

    def _is_affine_with_slack(self, cost: Any) -> bool:
        """Tell whether a cost is affine and has slack variables: it counts from 0 on."""
        if not isinstance(cost, Cost) or cost.atoms:
            return False
        return any(each.number in cost.rest.terms for each in self._slack)

    def _cost_at(self, cost: Any, points: dict[int, np.ndarray]) -> float:
        """Return one of its costs at points by numbers of vertices."""
        if not isinstance(cost, FunctionCost):
            value = float(cost.at(points))
            return max(value, 0.0) if self._is_affine_with_slack(cost) else value
        numbers = list(self._own())
        if self._slack:
            all_of_them = np.concatenate([points[each.number] for each in self._slack])
            numbers, points = [*numbers, self._slack[0].number], dict(points)
            points[self._slack[0].number] = all_of_them
        return cost.at(points, numbers)

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
        return self._cost_at(cost, points | dict(result.slack_variables))

    def _shares(
        self, result: GraphOfConvexSetsResult
    ) -> list[tuple[float, dict[int, np.ndarray]]]:
        """Return flows of a relaxation that count here, with the points that they go through."""
        raise NotImplementedError


def _used(terms: list[tuple[Any, frozenset[Transcription]]], asked: Any, label: str) -> list[Any]:
    some = as_transcriptions(asked, f"{label}: used_in_transcription")
    return [each for each, used in terms if used & some]
