"""Paths of graphs whose vertices and edges may have slack variables.

Graphs with some are solved as graphs whose points have them (`model.lifted_slack`), and answers
say what was asked.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from scene_graph_ros.convex.graphs.expressions.expressions import as_cost
from scene_graph_ros.convex.graphs.model.edge import Edge, Vertex
from scene_graph_ros.convex.graphs.model.lifted_slack import (
    has_slack,
    lifted_cost,
    LiftedSlack,
)
from scene_graph_ros.convex.graphs.model.options import GraphOfConvexSetsOptions
from scene_graph_ros.convex.graphs.network.network import Network
from scene_graph_ros.convex.graphs.relax.later import Later, Once
from scene_graph_ros.convex.graphs.search import given_path, shortest_path
from scene_graph_ros.convex.graphs.search.path_problem import network_of
from scene_graph_ros.convex.graphs.search.result import (
    GraphOfConvexSetsResult,
    RelaxationAnswer,
)
from scene_graph_ros.convex.solve.cones.solver_choice import SolverChoice

__all__ = ["ForwardSlack", "as_asked", "solve_path", "solve_restriction"]


def solve_path(
    vertices: Sequence[Vertex],
    edges: Sequence[Edge],
    network: Network,
    options: GraphOfConvexSetsOptions,
) -> GraphOfConvexSetsResult:
    """Return the shortest path, as `GraphOfConvexSets.solve_shortest_path` promises."""
    if not has_slack(vertices) and not has_slack(edges):
        return shortest_path.solve_path(vertices, edges, network, options)
    lifted = LiftedSlack()
    source, target = (lifted.vertex(vertices[k]) for k in (network.source, network.target))
    some = [each for edge in edges for each in lifted.edge(edge)]
    own = [edge.v for edge in some if edge.v.id < 0]
    points = [*(lifted.vertex(vertex) for vertex in vertices), *own]
    within = network_of(points, some, source, target)
    return as_asked(shortest_path.solve_path(points, some, within, options), lifted)


def solve_restriction(
    edges: Sequence[Edge],
    initial_guess: Any,
    solver: SolverChoice | None,
    is_over: Callable[[], bool] | None,
    limit: float = np.inf,
) -> GraphOfConvexSetsResult:
    """Return a path's best points, as `GraphOfConvexSets.solve_convex_restriction` promises.

    Of a path whose convex part costs ``limit`` at least there may be the lower bound alone.
    """
    guess = given_path.guessed_points(initial_guess, edges)
    visited = [] if not edges else [edges[0].u, *(edge.v for edge in edges)]
    if not has_slack(visited) and not has_slack(edges):
        return given_path.solve_restriction(edges, guess, solver, is_over, limit)
    lifted = LiftedSlack()
    some = [each for edge in edges for each in lifted.edge(edge)]
    if guess is not None:
        known = dict(getattr(initial_guess, "slack_variables", {}))
        at = dict(zip((vertex.id for vertex in visited), guess, strict=True))
        ends = [some[0].u, *(edge.v for edge in some)]
        guess = [_guessed(vertex, lifted, at, known) for vertex in ends]
    return as_asked(given_path.solve_restriction(some, guess, solver, is_over, limit), lifted)


def _guessed(
    vertex: Vertex,
    lifted: LiftedSlack,
    at: Mapping[int, np.ndarray],
    known: Mapping[int, np.ndarray],
) -> np.ndarray:
    """Return the guessed point of a lifted vertex: slack variables that are not known are 0."""
    of, owner = lifted.owner(vertex)
    slack = [known.get(s.number, np.zeros(len(s))) for s in owner._slack]
    return np.concatenate([at[of.id], *slack])


class ForwardSlack:
    """Successors, targets and heuristics of a graph that grows, of lifted vertices."""

    def __init__(
        self,
        successors: Callable[[Vertex], list[Edge]],
        is_target: Callable[[Vertex], bool],
        heuristic: Callable[[Vertex], Any] | None,
    ) -> None:
        self._successors, self._is_target, self._heuristic = successors, is_target, heuristic
        self.lifted = LiftedSlack()

    def successors(self, v: Vertex) -> list[Edge]:
        """Return the edges out of a lifted vertex."""
        of, owner = self.lifted.owner(v)
        if isinstance(owner, Edge):
            return [self.lifted.edge(owner)[-1]]
        return [self.lifted.edge(edge)[0] for edge in self._successors(of)]

    def is_target(self, v: Vertex) -> bool:
        """Tell whether a lifted vertex is a target."""
        of, owner = self.lifted.owner(v)
        return of is owner and self._is_target(of)

    def heuristic(self, v: Vertex) -> Any:
        """Return the heuristic's cost of a lifted vertex: that of the vertex it leads to."""
        of, _ = self.lifted.owner(v)
        assert self._heuristic is not None
        cost = as_cost(self._heuristic(of), f"heuristic of {of.name!r}")
        parts = (cost.rest, *(atom.of for atom in cost.atoms))
        is_own = all({*part.terms} <= {of.id} for part in parts)
        return lifted_cost(cost, of, v) if is_own else cost


def as_asked(found: GraphOfConvexSetsResult, lifted: LiftedSlack) -> GraphOfConvexSetsResult:
    """Return the answer about a graph from that about its lifted vertices and edges."""
    own = zip(found.vertices, found.points, strict=True)
    points = {number: lifted.split(number, x) for number, x in own}
    slack = {number: s for _, some in points.values() for number, s in some.items()}
    return replace(
        found,
        path=_given(found.path),
        vertices=_given(found.vertices),
        points=tuple(x for number, (x, _) in points.items() if number >= 0),
        edge_costs=_given_keys(found.edge_costs),
        vertex_costs=_given_keys(found.vertex_costs),
        relaxation=Once(lambda: _relaxation(found.relaxation(), lifted)),
        rounded_paths=tuple(_given(path) for path in found.rounded_paths),
        slack_variables=slack,
    )


def _given(numbers: Sequence[int]) -> tuple[int, ...]:
    """Return the numbers of a graph's own vertices or edges."""
    return tuple(number for number in numbers if number >= 0)


def _given_keys(costs: Mapping[int, float]) -> Mapping[int, float]:
    return Later(lambda: {number: cost for number, cost in costs.items() if number >= 0})


def _relaxation(found: RelaxationAnswer, lifted: LiftedSlack) -> RelaxationAnswer:
    """Return a relaxation's answer about a graph's own edges."""
    flows = {number: flow for number, flow in found.flows.items() if number >= 0}
    phi_xu, phi_xv, phi_slack = {}, {}, {}
    for number in flows:
        first, last = lifted.ends(number)
        phi_xu[number], of_u = lifted.split(first.u.id, found.phi_xu[first.id])
        phi_xv[number], of_v = lifted.split(last.v.id, found.phi_xv[last.id])
        _, own = lifted.split(first.v.id, found.phi_xv[first.id])
        phi_slack[number] = {**of_u, **own, **of_v}
    return replace(found, flows=flows, phi_xu=phi_xu, phi_xv=phi_xv, phi_slack_variables=phi_slack)
