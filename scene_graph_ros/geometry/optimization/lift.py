"""A set as what linear rows leave of more variables: the first of them are the set's points."""

from __future__ import annotations

from dataclasses import dataclass
import functools

import numpy as np

from scene_graph_ros.geometry.optimization.solve.rows import Rows

__all__ = ["Lift", "joined", "shared_point"]


@dataclass(frozen=True, eq=False)
class Lift:
    """All x of which there is a z with ``E (x, z) = f`` and ``A (x, z) <= b``.

    ``E`` is ``(k, n + e)`` and ``A`` ``(m, n + e)`` for n coordinates and e further variables;
    all numbers are those that the set was given, unrounded.
    """

    E: np.ndarray
    f: np.ndarray
    A: np.ndarray
    b: np.ndarray

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

    def placed(self, columns: np.ndarray, num_variables: int) -> Lift:
        """Return the same rows with variable k as variable ``columns[k]`` of so many."""
        E = np.zeros((len(self.f), num_variables))
        A = np.zeros((len(self.b), num_variables))
        E[:, columns], A[:, columns] = self.E, self.A
        return Lift(E, self.f, A, self.b)


def joined(lifts: list[Lift]) -> Lift:
    """Return all rows of lifts that have the same variables."""
    return Lift(
        *(np.concatenate([getattr(lift, name) for lift in lifts]) for name in ("E", "f", "A", "b"))
    )


def shared_point(lifts: list[Lift], dimension: int) -> Lift:
    """Return the intersection: one point, and the further variables of each."""
    total = dimension + sum(lift.num_variables - dimension for lift in lifts)
    placed, first = [], dimension
    for lift in lifts:
        extra = lift.num_variables - dimension
        columns = np.concatenate([np.arange(dimension), np.arange(first, first + extra)])
        placed.append(lift.placed(columns, total))
        first += extra
    if not placed:
        empty = np.zeros((0, dimension))
        return Lift(empty, np.zeros(0), empty, np.zeros(0))
    return joined(placed)
