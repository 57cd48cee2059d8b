"""Costs and constraints of all subgraphs and edges between them, now and later."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from scene_graph_ros.convex.graphs.model.whole_edits import as_before, Undo, WholeEdits
from scene_graph_ros.convex.questions.arguments import as_nonnegative, as_whole
from scene_graph_ros.planning.gcs.arguments import as_bounds, as_weights
from scene_graph_ros.planning.gcs.edges_between_subgraphs import EdgesBetweenSubgraphs
from scene_graph_ros.planning.gcs.joined_edges import JoinedEdges
from scene_graph_ros.planning.gcs.subgraph import Subgraph

__all__ = ["AllSubgraphs"]


class AllSubgraphs:
    """Costs and constraints of all segments at once, also of those that are added later."""

    def __init__(self, num_positions: int) -> None:
        self._num_positions = num_positions
        self._subgraphs: list[Subgraph] = []
        self._between: list[EdgesBetweenSubgraphs] = []
        self._rules: list[Callable[[JoinedEdges], None]] = []
        self._whole_edits = WholeEdits()

    def _apply_rules(self, to: JoinedEdges) -> None:
        for rule in self._rules:
            rule(to)

    def _undos(self) -> Iterable[Undo]:
        """Return the steps that undo an edit of the lists here."""
        yield as_before(self, ("_subgraphs", "_between", "_rules"))

    def _undos_of_all(self) -> Iterable[Undo]:
        """Return the steps that undo an edit of all that there is."""
        yield from self._undos()
        for each in (*self._subgraphs, *self._between):
            yield from each._undos()

    def _rule(self, rule: Callable[[JoinedEdges], None]) -> None:
        """Have a rule hold for all that there is, and for all to come."""

        def change() -> None:
            for each in (*self._subgraphs, *self._between):
                rule(each)
            self._rules.append(rule)

        self._whole_edits.make(self._undos_of_all, change)

    def _rule_of_regions(
        self,
        change: Callable[[Subgraph], None],
        concerns: Callable[[Subgraph], bool] = lambda subgraph: subgraph.order > 0,
    ) -> None:
        """Change each subgraph that it concerns, now and later: those with segments that move."""

        def rule(to: JoinedEdges) -> None:
            if isinstance(to, Subgraph) and concerns(to):
                change(to)

        self._rule(rule)

    def add_time_cost(self, weight: float = 1.0) -> None:
        """Add ``weight`` times the duration, of all subgraphs whose segments take time."""
        number = as_nonnegative(weight, "GcsTrajectoryOptimization.add_time_cost: weight")
        self._rule_of_regions(
            lambda subgraph: subgraph.add_time_cost(number),
            lambda subgraph: subgraph.variables.has_duration,
        )

    def add_path_length_cost(self, weight: Any = 1.0) -> None:
        """Add a bound of the path's length from above; see `Subgraph.add_path_length_cost`."""
        label = "GcsTrajectoryOptimization.add_path_length_cost"
        W = as_weights(weight, self._num_positions, label)
        self._rule_of_regions(lambda subgraph: subgraph.add_path_length_cost(W))

    def add_path_energy_cost(self, weight: Any = 1.0) -> None:
        """Add squares of ways between control points; see `Subgraph.add_path_energy_cost`."""
        label = "GcsTrajectoryOptimization.add_path_energy_cost"
        W = as_weights(weight, self._num_positions, label)
        self._rule_of_regions(lambda subgraph: subgraph.add_path_energy_cost(W))

    def add_velocity_bounds(self, lb: Any, ub: Any) -> None:
        """Ask for ``lb <= dq/dt <= ub`` ``(n,)`` at all times, of all segments."""
        low, high = as_bounds(
            lb, ub, self._num_positions, "GcsTrajectoryOptimization.add_velocity_bounds"
        )
        self._rule_of_regions(lambda subgraph: subgraph.add_velocity_bounds(low, high))

    def add_path_continuity_constraints(self, continuity_order: int) -> None:
        """Ask that derivatives of r(s) go on from region to region, up to an order.

        Along all edges between segments of that order and above; others have no such derivative.
        """
        label = "GcsTrajectoryOptimization.add_path_continuity_constraints: continuity_order"
        order = as_whole(continuity_order, label, 1)

        def rule(to: JoinedEdges) -> None:
            if to.most_continuity >= order:
                to.add_path_continuity_constraints(order)

        self._rule(rule)

    def add_continuity_constraints(self, continuity_order: int) -> None:
        """Ask that the derivative of q(t) of an order goes on from region to region.

        Along all edges between segments of that order and above; see
        `JoinedEdges.add_continuity_constraints`.
        """
        label = "GcsTrajectoryOptimization.add_continuity_constraints: continuity_order"
        order = as_whole(continuity_order, label, 1)

        def rule(to: JoinedEdges) -> None:
            if to.most_continuity >= order:
                to.add_continuity_constraints(order)

        self._rule(rule)

    def add_nonlinear_derivative_bounds(self, lb: Any, ub: Any, derivative_order: int) -> None:
        """Ask for ``lb <= q^(N)(t) <= ub`` ``(n,)``, of all segments of order N and above."""
        label = "GcsTrajectoryOptimization.add_nonlinear_derivative_bounds"
        low, high = as_bounds(lb, ub, self._num_positions, label)
        order = as_whole(derivative_order, f"{label}: derivative_order", 2)

        def rule(to: JoinedEdges) -> None:
            if isinstance(to, Subgraph) and to.order >= order:
                to.add_nonlinear_derivative_bounds(low, high, order)

        self._rule(rule)

    def _has_nonlinear_terms(self) -> bool:
        """Tell whether something is asked of derivatives that is not convex."""
        return any(each.continuous_derivatives for each in (*self._subgraphs, *self._between)) or (
            any(each.has_nonlinear_bounds for each in (*self._subgraphs, *self._between))
        )
