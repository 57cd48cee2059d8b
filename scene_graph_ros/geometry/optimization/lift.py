"""A set as what rows and balls leave of more variables: the first of them are its points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import functools

import numpy as np

from scene_graph_ros.geometry.optimization.solve.rows import Rows

__all__ = ["Ball", "Lift", "equations", "joined", "shared_point"]


@dataclass(frozen=True, eq=False)
class Ball:
    """The variables ``columns`` are no longer than variable ``scale``, than 1 where that is -1."""

    columns: np.ndarray
    scale: int = -1


@dataclass(frozen=True, eq=False)
class Lift:
    """All x of which there is a z with ``E (x, z) = f``, ``A (x, z) <= b`` and some in balls.

    ``E`` is ``(k, n + e)`` and ``A`` ``(m, n + e)`` for n coordinates and e further variables;
    all numbers are those that the set was given, unrounded. Without balls the set is flat.
    """

    E: np.ndarray
    f: np.ndarray
    A: np.ndarray
    b: np.ndarray
    balls: tuple[Ball, ...] = ()

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

        What is in a ball stays; so does a ball's scale, which is between 0 and 1 in all lifts.
        Right sides play no part.
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
        balls = tuple(
            Ball(columns[ball.columns], -1 if ball.scale < 0 else int(columns[ball.scale]))
            for ball in self.balls
        )
        return Lift(E, self.f, A, self.b, balls)


def joined(lifts: Sequence[Lift]) -> Lift:
    """Return all rows and balls of lifts that have the same variables."""
    E, f, A, b = (
        np.concatenate([getattr(lift, name) for lift in lifts]) for name in ("E", "f", "A", "b")
    )
    return Lift(E, f, A, b, tuple(ball for lift in lifts for ball in lift.balls))


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
