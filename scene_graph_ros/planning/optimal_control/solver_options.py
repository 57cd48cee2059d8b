"""How long, and how exactly, a nonlinear program is solved."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.planning.optimal_control.arguments import as_count, as_positive

__all__ = ["SolverOptions"]


@one_line()
@dataclass(frozen=True)
class SolverOptions:
    """The options of IPOPT.

    ``tolerance`` is that of its optimality conditions, scaled; ``feasibility_tolerance`` is the
    excess that a constraint may have over its bound, in its own units. A search that ends away
    from all solutions begins again up to ``restarts`` times, from guesses with noise, the same
    each time. ``max_iterations`` and ``timeout``, in s, are those of one start. ``ipopt`` are
    options of IPOPT's own, which go before all else.
    """

    tolerance: float = 1e-8
    feasibility_tolerance: float = 1e-7
    max_iterations: int = 1000
    timeout: float = 300.0
    restarts: int = 4
    print_level: int = 0
    ipopt: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Raise TrajectoryOptimizationError for options that make no sense."""
        as_positive("tolerance", self.tolerance)
        as_positive("feasibility_tolerance", self.feasibility_tolerance)
        as_positive("timeout", self.timeout)
        as_count("max_iterations", self.max_iterations, 0)
        as_count("restarts", self.restarts, 0)
