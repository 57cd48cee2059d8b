"""How shortest paths are found."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.convex.questions.arguments import as_nonnegative
from scene_graph_ros.convex.solve.cones.solver_choice import (
    as_choice,
    CONTINUOUS,
    MIXED_INTEGER,
    SolverChoice,
)
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted

__all__ = ["GcsGraphvizOptions", "GraphOfConvexSetsOptions", "as_options"]


@one_line()
@dataclass(frozen=True, kw_only=True)
class GraphOfConvexSetsOptions:
    """Options of a shortest path problem. Raises ConvexSetError naming option and value."""

    convex_relaxation: bool | None = None
    """Whether to solve the relaxation and round it; otherwise paths are searched until the best
    is proven to be, which is the default."""
    preprocessing: bool | None = None
    """Whether edges that can't be on a simple path are left out first, as by default."""
    max_rounded_paths: int | None = None
    """How many different paths of the relaxation are compared, 5 by default: that with the most
    flow, and others that are drawn. With 0 and ``convex_relaxation`` the relaxation alone is
    solved."""
    max_rounding_trials: int = 100
    """How many are drawn to find that many different ones."""
    max_tightenings: int = 2
    """How often the relaxation is solved again where its flows go along an edge and back along
    another, with constraints that no path does so; ever more of these are added."""
    flow_tolerance: float = 1e-5
    """Edges with no more flow are not drawn."""
    rounding_seed: int = 0
    """Of what is drawn."""
    gap_tolerance: float = 1e-6
    """Relative to the cost: how near the bound has to be where paths are searched; no further ones
    of the relaxation are compared when it is."""
    max_search_programs: int = 10_000
    """How many convex programs the search solves at most; what is then left is the gap."""
    termination_func: Callable[[], bool] | None = None
    """Asked before each program, and at each iteration of Clarabel and of IPOPT: where it returns
    True the search ends, and what is left is the gap. What it raises is raised."""
    solver: str | None = None
    """What solves the relaxation, and single paths unless ``restriction_solver`` does: "clarabel",
    the default, "highs" where all is linear, or "scs"; or "scip", for the exact problem as one
    mixed-integer program instead of the search."""
    solver_options: Mapping[str, Any] | None = None
    """What settings of its own that solver gets, by their names."""
    restriction_solver: str | None = None
    """What solves single paths, by default ``solver``."""
    restriction_solver_options: Mapping[str, Any] | None = None
    """Its settings, by default ``solver_options`` where it is the same solver."""
    preprocessing_solver: str | None = None
    """What solves a program of flows for each edge that preprocessing by walks of the graph has
    left, and leaves out those that can't be on a path, too; by default none is solved."""
    preprocessing_solver_options: Mapping[str, Any] | None = None
    """Its settings, by default ``solver_options`` where it is the same solver."""

    def __post_init__(self) -> None:
        """Check all values."""
        for name in ("convex_relaxation", "preprocessing"):
            value = getattr(self, name)
            if value is not None and not isinstance(value, bool):
                raise ConvexSetError(
                    f"GraphOfConvexSetsOptions: {name} must be True, False or None, not"
                    f" {quoted(value)}"
                )
        for name in (
            "max_rounded_paths",
            "max_rounding_trials",
            "max_tightenings",
            "rounding_seed",
            "max_search_programs",
        ):
            number: Any = getattr(self, name)
            if number is None and name == "max_rounded_paths":
                continue
            if isinstance(number, bool) or not isinstance(number, int) or number < 0:
                raise ConvexSetError(
                    f"GraphOfConvexSetsOptions: {name} must be a whole number, at least 0, not"
                    f" {quoted(number)}"
                )
        for name in ("flow_tolerance", "gap_tolerance"):
            as_nonnegative(getattr(self, name), f"GraphOfConvexSetsOptions: {name}")
        if self.termination_func is not None and not callable(self.termination_func):
            raise ConvexSetError(
                "GraphOfConvexSetsOptions: termination_func must be a function or None, not"
                f" {quoted(self.termination_func)}"
            )
        if self.mixed_integer is not None and self.convex_relaxation:
            raise ConvexSetError(
                f"GraphOfConvexSetsOptions: solver {self.solver!r} solves the exact problem; leave"
                " convex_relaxation out, or take another solver"
            )
        # The other names are checked where they are read.
        _ = self.of_restriction, self.of_preprocessing

    @property
    def mixed_integer(self) -> SolverChoice | None:
        """The solver of the exact problem as one program, if that is chosen."""
        known = {**CONTINUOUS, **MIXED_INTEGER}
        label = "GraphOfConvexSetsOptions: solver"
        chosen = as_choice(self.solver, self.solver_options, label, known)
        return chosen if chosen is not None and chosen.name in MIXED_INTEGER else None

    @property
    def continuous(self) -> SolverChoice | None:
        """The solver of programs without whole numbers; None for the default."""
        if self.mixed_integer is not None:
            return None
        label = "GraphOfConvexSetsOptions: solver"
        return as_choice(self.solver, self.solver_options, label)

    @property
    def of_restriction(self) -> SolverChoice | None:
        """The solver of single paths; None for the default."""
        return self._other("restriction_solver")

    @property
    def of_preprocessing(self) -> SolverChoice | None:
        """The solver of programs of flows in preprocessing; None where there are none."""
        if self.preprocessing_solver is None and self.preprocessing_solver_options is None:
            return None
        return self._other("preprocessing_solver")

    def _other(self, which: str) -> SolverChoice | None:
        name, options = getattr(self, which), getattr(self, f"{which}_options")
        first = self.continuous
        usual = first.name if first is not None else "clarabel"
        if options is None and first is not None and name in (None, first.name):
            options = first.options
        if name is None and (options is not None or first is not None):
            name = usual
        return as_choice(name, options, f"GraphOfConvexSetsOptions: {which}")


@one_line()
@dataclass(frozen=True, kw_only=True)
class GcsGraphvizOptions:
    """Options of a drawing of a graph's result."""

    show_slacks: bool = True
    """The flow times the points, at each edge."""
    show_vars: bool = True
    """The point of each vertex."""
    show_flows: bool = True
    """The flow of each edge, as a number and as the strength of its line."""
    show_costs: bool = True
    """The cost of each edge on the path."""
    scientific: bool = False
    """Numbers with an exponent."""
    precision: int = 3
    """Digits after the point."""


def as_options(options: Any, question: str) -> GraphOfConvexSetsOptions:
    """Return options, those by default for None. Raises ConvexSetError for another object."""
    if options is None:
        return GraphOfConvexSetsOptions()
    if not isinstance(options, GraphOfConvexSetsOptions):
        raise ConvexSetError(
            f"{question}: options must be GraphOfConvexSetsOptions or None, not {quoted(options)}"
        )
    return options
