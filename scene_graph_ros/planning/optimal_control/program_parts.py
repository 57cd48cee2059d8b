"""The parts of a nonlinear program."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["Block", "Constraint", "ProgramParts"]


@dataclass(frozen=True, eq=False)
class Constraint:
    """``lower <= expression <= upper``, row by row, with the knots each row is about."""

    expression: Any
    lower: NDArray[np.float64]
    upper: NDArray[np.float64]
    label: str
    knots: NDArray[np.int64] = field(default_factory=lambda: np.zeros((0, 0), dtype=np.int64))
    """``(rows, 0 to 2)``."""


@dataclass(frozen=True, eq=False)
class Block:
    """A function of few variables, the same for each step: of costs, or rows of constraints."""

    function: Any
    """CasADi's, of ``(k,)`` variables; of scalar operations."""
    columns: NDArray[np.int64]
    """``(count, k)``: its variables at each step, by their place in all."""
    rows: NDArray[np.int64]
    """``(count, r)``: the constraints' rows that it has at each step; ``(count, 0)`` of a cost."""

    @property
    def count(self) -> int:
        """How many steps there are."""
        return len(self.columns)


class ProgramParts:
    """Variables with a guess, costs that are added, constraints that all hold."""

    def __init__(self) -> None:
        self.variables: list[Any] = []
        self.constraints: list[Constraint] = []
        self.costs: list[Any] = []
        self.block_costs: list[Any] = []
        """Those that are blocks, too."""
        self.blocks: list[Block] = []
        """What the costs and constraints repeat at each step, so that it is derived once."""
        self.callbacks: list[Callable[[NDArray[np.float64]], None]] = []
        """Called with all variables at each iteration."""
        self.has_second_derivatives = True
        """Whether all expressions have them; else they are approximated (limited-memory BFGS)."""
        self.has_rough_guess = False
        """Whether the guess is far from what the constraints ask, as a straight line is."""
        self.raise_error: list[Callable[[], None]] = []
        """What raises errors that CasADi lost."""
        self._guesses: list[NDArray[np.float64]] = []

    @property
    def num_variables(self) -> int:
        """How many numbers are sought."""
        return sum(v.shape[0] for v in self.variables)

    @property
    def initial_guess(self) -> NDArray[np.float64]:
        """Where the search begins, ``(n,)``."""
        return np.concatenate([np.zeros(0), *self._guesses])
