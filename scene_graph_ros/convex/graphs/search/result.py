"""The result of a shortest path problem."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from scene_graph_ros.convex.graphs.expressions.transcription import Transcription
from scene_graph_ros.convex.graphs.relax.bounds import bound_of_paths, Potentials
from scene_graph_ros.convex.graphs.relax.later import Once
from scene_graph_ros.convex.graphs.relax.relaxation import Problem
from scene_graph_ros.geometry.one_line import one_line

__all__ = ["GraphOfConvexSetsResult", "PathBound"]


@one_line()
@dataclass(frozen=True, eq=False)
class PathBound:
    """The proof of a lower bound: a potential for each vertex, multipliers for each edge."""

    value: float
    problem: Problem
    potentials: Potentials

    def verify(self) -> bool:
        """Compute the bound again by weak duality, with all rounding counted against it."""
        return bound_of_paths(self.problem, self.potentials).value >= self.value


@dataclass(frozen=True, eq=False)
class RelaxationAnswer:
    """The relaxation's answer: its cost, flows and points by the numbers of edges, its bound.

    ``phi_xu`` and ``phi_xv`` ``(n,)`` are the flow times the points of an edge, and
    ``phi_slack_variables`` times its slack variables and those of its vertices. The cost is the
    solver's word; the bound is proven.
    """

    cost: float = np.nan
    flows: Mapping[int, float] = field(default_factory=dict)
    phi_xu: Mapping[int, np.ndarray] = field(default_factory=dict)
    phi_xv: Mapping[int, np.ndarray] = field(default_factory=dict)
    bound: PathBound | None = None
    phi_slack_variables: Mapping[int, Mapping[int, np.ndarray]] = field(default_factory=dict)


_NO_RELAXATION = Once.of(RelaxationAnswer())


@one_line()
@dataclass(frozen=True, eq=False)
class GraphOfConvexSetsResult:
    """A path with its points, and a lower bound of all paths.

    ``path`` are the numbers of its edges and ``vertices`` of its vertices; ``points`` ``(n,)`` for
    each of them. ``cost`` is that of the points, infinite without a path; ``reason`` says why
    there is none, or why the search ended. ``flows``, ``phi_xu`` and ``phi_xv`` are the
    relaxation's, by the numbers of edges, and ``transcription`` its form; where a path
    was found without one it is solved when one of them is first read.
    ``rounded_paths`` are the edges of each path of the relaxation that was compared.
    ``slack_variables`` ``(k,)`` are those of edges and vertices on the path, by their numbers in
    expressions. ``is_stopped`` tells whether the options' ``termination_func`` ended the search.
    ``solver_bound`` is a mixed-integer solver's lower bound of all paths: not proven.
    """

    is_success: bool
    cost: float
    lower_bound: float
    reason: str
    path: tuple[int, ...] = ()
    vertices: tuple[int, ...] = ()
    points: tuple[np.ndarray, ...] = ()
    edge_costs: Mapping[int, float] = field(default_factory=dict)
    vertex_costs: Mapping[int, float] = field(default_factory=dict)
    relaxation: Once[RelaxationAnswer] = _NO_RELAXATION
    violation: float = 0.0
    num_edges_solved: int = 0
    num_rounded_paths: int = 0
    num_search_programs: int = 0
    solver_bound: float = np.nan
    transcription: Transcription = Transcription.MIP
    is_stopped: bool = False
    rounded_paths: tuple[tuple[int, ...], ...] = ()
    slack_variables: Mapping[int, np.ndarray] = field(default_factory=dict)

    @property
    def flows(self) -> Mapping[int, float]:
        """The flow along each edge."""
        return self.relaxation().flows

    @property
    def phi_xu(self) -> Mapping[int, np.ndarray]:
        """The flow times the point ``(n,)`` that each edge leads from."""
        return self.relaxation().phi_xu

    @property
    def phi_xv(self) -> Mapping[int, np.ndarray]:
        """The flow times the point ``(n,)`` that each edge leads to."""
        return self.relaxation().phi_xv

    @property
    def phi_slack_variables(self) -> Mapping[int, Mapping[int, np.ndarray]]:
        """The flow times the slack variables ``(k,)`` of each edge and its vertices."""
        return self.relaxation().phi_slack_variables

    @property
    def relaxation_cost(self) -> float:
        """The relaxation's cost, by the solver; NaN where there is none."""
        return self.relaxation().cost

    @property
    def relaxation_bound(self) -> PathBound | None:
        """The proof of the relaxation's bound of all paths."""
        return self.relaxation().bound

    @property
    def gap(self) -> float:
        """How much less than the cost a path might cost, in the cost's own units."""
        return max(0.0, self.cost - self.lower_bound) if self.is_success else np.inf
