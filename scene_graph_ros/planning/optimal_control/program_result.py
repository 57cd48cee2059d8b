"""A solver's answer, and its violations."""

from __future__ import annotations

from dataclasses import dataclass, field
import enum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.one_line import one_line

__all__ = ["ConstraintViolation", "ProgramResult", "SolveStatus"]


class SolveStatus(enum.Enum):
    """How a solver ended."""

    SOLVED = "solved"
    NEARLY_SOLVED = "no further improvement, short of the tolerance"
    INFEASIBLE = "no way found to hold all constraints near this guess"
    ITERATION_LIMIT = "iterations were used up"
    TIME_LIMIT = "time was used up"
    INVALID_NUMBER = "a cost, constraint or derivative is no number"
    STOPPED = "stopped by a callback"
    FAILED = "the solver gave up"


@one_line()
@dataclass(frozen=True)
class ConstraintViolation:
    """A row of a constraint that does not hold, and when: ``amount`` beyond its bound."""

    label: str
    row: int
    amount: float
    value: float
    lower: float
    upper: float
    knots: tuple[int, ...] = ()
    """The samples it is about: none, one, or the two ends of a step."""
    time: float | None = None
    """When, s: the first of its knots, where it has some."""
    expression: Any = field(default=None, repr=False, compare=False)
    """The constraint's, of all its rows."""

    def __str__(self) -> str:
        """Return it in words."""
        where = f", row {self.row}"
        if self.time is not None:
            where += f", at t = {self.time:.6g} s"
        return (
            f"{self.label}{where}: {self.value:.6g} is not in [{self.lower:.6g},"
            f" {self.upper:.6g}], by {self.amount:.3g}"
        )


@one_line()
@dataclass(frozen=True, eq=False)
class ProgramResult:
    """A point, whether it is a solution, and its violations where it is none.

    Where the solver stopped early ``x`` is the best point it came by: the cheapest of those that
    hold all constraints, else the one that holds them best. It is no success then.
    """

    is_success: bool
    status: SolveStatus
    cost: float
    reason: str
    """Why there is no success, empty where there is: what is violated, by how much and when."""
    violations: tuple[ConstraintViolation, ...]
    """What is beyond the tolerance, the worst first; at most 20."""
    largest_violation: float
    """Of all constraints, whether within the tolerance or not."""
    iterations: int
    """Of all starts."""
    starts: int
    """How often the search began: once, unless it had to be tried again."""
    solver_status: str
    """The solver's own word."""
    seconds: float
    """Processor time, s."""
    x: NDArray[np.float64]
    """All variables ``(n,)``."""
    multipliers: tuple[NDArray[np.float64], NDArray[np.float64]] = field(repr=False)
    """Of variables and of constraints, for a warm start."""
    evaluate: Any = field(repr=False)

    def value(self, expression: Any) -> NDArray[np.float64]:
        """Return the value of an expression of the program's variables here, in its shape."""
        return self.evaluate(expression, self.x)
