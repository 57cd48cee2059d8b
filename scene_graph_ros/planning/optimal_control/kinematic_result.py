"""The result of a kinematic trajectory optimization."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.planning.edges.edge_measure import EdgeMeasure
from scene_graph_ros.planning.optimal_control.program_result import (
    ConstraintViolation,
    ProgramResult,
    SolveStatus,
)
from scene_graph_ros.trajectories.bspline_trajectory import BsplineTrajectory

__all__ = ["KinematicTrajectoryResult"]


@one_line()
@dataclass(frozen=True, eq=False)
class KinematicTrajectoryResult:
    """A curve in time, whether it is a solution, and its violations where it is none."""

    program_result: ProgramResult = field(repr=False)
    is_success: bool
    """Whether it was solved, bounds hold at all times, and it is proven free where asked."""
    reason: str
    """Why there is no success, empty where there is."""
    trajectory: BsplineTrajectory
    """q(t) over [0, T]."""
    bounds_excess: float
    """How far derivatives' control points are beyond their bounds, in units of these."""
    measures: tuple[EdgeMeasure, ...]
    """What each checker proved of each polynomial of the curve, in turn."""
    rounds: int
    """How often it was solved, each time with clearance held at further places."""

    @property
    def status(self) -> SolveStatus:
        """How the solver ended."""
        return self.program_result.status

    @property
    def cost(self) -> float:
        """The cost of the curve."""
        return self.program_result.cost

    @property
    def duration(self) -> float:
        """How long it takes, s."""
        return self.trajectory.duration

    @property
    def violations(self) -> tuple[ConstraintViolation, ...]:
        """The violations beyond the solver's tolerance, the worst first."""
        return self.program_result.violations

    @property
    def least_clearance(self) -> float:
        """Lower bound of pairs' distances beyond their padding, m; 0 unless that was proven."""
        if not self.measures or not all(m.completely_free for m in self.measures):
            return 0.0
        return min(measure.least_clearance for measure in self.measures)

    def value(self, expression: Any) -> NDArray[np.float64]:
        """Return the value of an expression of the program's variables here, in its shape."""
        return self.program_result.value(expression)
