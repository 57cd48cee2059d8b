"""The result of a trajectory optimization."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.planning.optimal_control.program_result import (
    ConstraintViolation,
    ProgramResult,
    SolveStatus,
)
from scene_graph_ros.trajectories.piecewise_polynomial import PiecewisePolynomial

__all__ = ["TrajectoryOptimizationResult"]


@one_line()
@dataclass(frozen=True, eq=False)
class TrajectoryOptimizationResult:
    """A trajectory, whether it is a solution, and its violations where it is none.

    Where the solver stopped early it is the best one it came by, and no success.
    """

    program_result: ProgramResult = field(repr=False)
    violations: tuple[ConstraintViolation, ...]
    """What is beyond the tolerance, and when; the worst first, at most 20."""
    reason: str
    """Why there is no success, empty where there is."""
    sample_times: NDArray[np.float64]
    """``(N,)``, s."""
    states: NDArray[np.float64]
    """``(N, n)``."""
    inputs: NDArray[np.float64]
    """``(N, m)``."""
    trajectory: PiecewisePolynomial
    """The state over time."""
    input_trajectory: PiecewisePolynomial | None
    """The input over time; None without inputs."""
    residual_between_knots: float
    """How far the state's rate is from the dynamics anywhere between knots, at places that halve
    steps three times. It is what the discretization leaves, not the solver."""
    residual_time: float
    """When that is, s."""

    @property
    def is_success(self) -> bool:
        """Whether the solver reached its tolerance and all constraints hold."""
        return self.program_result.is_success

    @property
    def status(self) -> SolveStatus:
        """How the solver ended."""
        return self.program_result.status

    @property
    def cost(self) -> float:
        """The cost of the trajectory."""
        return self.program_result.cost

    @property
    def iterations(self) -> int:
        """How many the solver took."""
        return self.program_result.iterations

    @property
    def largest_violation(self) -> float:
        """Of all constraints, the dynamics at knots included."""
        return self.program_result.largest_violation

    def value(self, expression: Any) -> NDArray[np.float64]:
        """Return the value of an expression of the program's variables here, in its shape."""
        return self.program_result.value(expression)
