"""A set as the part of more variables within rows and cones: the first of them are its points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import functools

import numpy as np

from scene_graph_ros.convex.solve.exact.rows import Rows

__all__ = ["Ball", "Lift", "Semidefinite", "equations", "joined", "shared_point"]


@dataclass(frozen=True, eq=False)
class Ball:
    """The variables ``columns`` are no longer than variable ``scale``, than 1 where that is -1."""

    columns: np.ndarray
    scale: int = -1


@dataclass(frozen=True, eq=False)
class Semidefinite:
    """The symmetric matrix of the variables ``columns (N, N)`` has no negative eigenvalue.

    Beside the mirrored ones its entries are variables of their own.
    """

    columns: np.ndarray


@dataclass(frozen=True, eq=False)
class Lift:
    """All x of which there is a z with ``E (x, z) = f``, ``A (x, z) <= b`` and some in cones.

    ``E`` is ``(k, n + e)`` and ``A`` ``(m, n + e)`` for n coordinates and e further variables;
    all numbers are those that the set was given, unrounded. Without balls and semidefinite
    matrices, which are the ``cones``, the set is flat.
    """

    E: np.ndarray
    f: np.ndarray
    A: np.ndarray
    b: np.ndarray
    cones: tuple[Ball | Semidefinite, ...] = ()

    @functools.cached_property
    def balls(self) -> tuple[Ball, ...]:
        """Those of the cones that are balls."""
        return tuple(cone for cone in self.cones if isinstance(cone, Ball))

    @functools.cached_property
    def matrices(self) -> tuple[Semidefinite, ...]:
        """Those of the cones that are matrices."""
        return tuple(cone for cone in self.cones if isinstance(cone, Semidefinite))

    @property
    def num_variables(self) -> int:
        """Coordinates and further variables."""
        return self.A.shape[1]

    @functools.cached_property
    def rows(self) -> Rows:
        """The equations, then the inequalities."""
        return Rows(
            np.concatenate([self.E, self.A]), np.concatenate([self.f, self.b]), len(self.f)
        )

    @functools.cached_property
    def directions(self) -> Rows:
        """The rows of the directions that lead on for ever, behind equations for balls.

        A ball's vector stays; so does a ball's scale, which is between 0 and 1 in all lifts.
        Right sides play no part; matrices stay semidefinite beside these rows.
        """
        held = [k for ball in self.balls for k in (*ball.columns, ball.scale) if k >= 0]
        still = np.eye(self.num_variables)[sorted(set(held))]
        E = np.concatenate([self.E, still])
        A = np.concatenate([E, self.A])
        return Rows(A, np.zeros(len(A)), len(E))

    def placed(self, columns: np.ndarray, num_variables: int) -> Lift:
        """Return the same rows with variable k as variable ``columns[k]`` of so many."""
        E = np.zeros((len(self.f), num_variables))
        A = np.zeros((len(self.b), num_variables))
        E[:, columns], A[:, columns] = self.E, self.A
        return Lift(E, self.f, A, self.b, tuple(_moved(cone, columns) for cone in self.cones))


def _moved(cone: Ball | Semidefinite, columns: np.ndarray) -> Ball | Semidefinite:
    if isinstance(cone, Semidefinite):
        return Semidefinite(columns[cone.columns])
    return Ball(columns[cone.columns], -1 if cone.scale < 0 else int(columns[cone.scale]))


def joined(lifts: Sequence[Lift]) -> Lift:
    """Return all rows and cones of lifts that have the same variables, in order."""
    E, f, A, b = (
        np.concatenate([getattr(lift, name) for lift in lifts]) for name in ("E", "f", "A", "b")
    )
    return Lift(E, f, A, b, tuple(cone for lift in lifts for cone in lift.cones))


def equations(E: np.ndarray, f: np.ndarray) -> Lift:
    """Return a lift of equations alone."""
    return Lift(E, f, np.zeros((0, E.shape[1])), np.zeros(0))


def shared_point(lifts: Sequence[Lift], dimension: int) -> Lift:
    """Return the intersection: one point, and the further variables of each."""
    total = dimension + sum(lift.num_variables - dimension for lift in lifts)
    placed, first = [equations(np.zeros((0, total)), np.zeros(0))], dimension
    for lift in lifts:
        extra = lift.num_variables - dimension
        columns = np.concatenate([np.arange(dimension), np.arange(first, first + extra)])
        placed.append(lift.placed(columns, total))
        first += extra
    return joined(placed)
