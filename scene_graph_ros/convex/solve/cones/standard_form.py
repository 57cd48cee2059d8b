"""The form in which solvers take cone programs, and the form in which they answer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import enum
import math
from typing import Any, NamedTuple

import numpy as np

__all__ = ["Cone", "Reply", "StandardForm", "Status"]


class Cone(enum.IntEnum):
    """The cone of a program's rows."""

    ZERO = 0
    NONNEGATIVE = 1
    SECOND_ORDER = 2
    """The first row is no shorter than all the others together."""
    SEMIDEFINITE = 3
    """The upper triangle of a symmetric matrix without negative eigenvalues, column after column,
    entries beside the diagonal times the root of 2."""
    EXPONENTIAL = 4
    """Three rows (u, v, w) with ``v exp(u / v) <= w`` and v > 0, and limits of such."""


class StandardForm(NamedTuple):
    """Minimize ``q . x`` where ``b - A x`` is in cones, in the order of `Cone`."""

    A: Any
    """Sparse ``(m, n)``, by columns."""
    b: np.ndarray
    q: np.ndarray
    counts: Mapping[Cone, int]
    """Rows of each kind of cone."""
    sizes: Mapping[Cone, Sequence[int]]
    """Rows of each cone of the kinds behind the linear ones."""

    @property
    def linear(self) -> tuple[int, int]:
        """The numbers of equations and of inequalities."""
        return self.counts[Cone.ZERO], self.counts[Cone.NONNEGATIVE]

    @property
    def orders(self) -> list[int]:
        """The orders of the matrices."""
        return [math.isqrt(2 * size) for size in self.sizes[Cone.SEMIDEFINITE]]


class Status(enum.Enum):
    """The verdict of a solver on a program, whichever its own words are."""

    SOLVED = enum.auto()
    INFEASIBLE = enum.auto()
    """No x has its rows in the cones; the multipliers are to show it."""
    UNBOUNDED = enum.auto()
    """The cost goes down for ever."""
    UNSURE = enum.auto()
    """The solver gave up, or is less exact than asked."""


class Reply(NamedTuple):
    """A solver's answer: ``x (n,)``, multipliers ``z (m,)`` and ``s = b - A x``."""

    x: np.ndarray
    z: np.ndarray
    s: np.ndarray
    status: Status
    word: str
    """The status as the solver calls it."""
