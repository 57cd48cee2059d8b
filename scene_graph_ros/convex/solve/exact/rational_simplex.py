"""The simplex method in rational arithmetic: its answers are proofs.

The same walk as in `active_set`, with Bland's rule (1977), which never runs in circles. All
numbers are whole: rows are multiplied by powers of two until they are, points have a common
denominator, and the basis has its adjugate in place of its inverse, so that every division is
exact (Edmonds 1967; Bareiss 1968).
"""

from __future__ import annotations

from fractions import Fraction
import math
from typing import Any

import numpy as np

__all__ = ["RationalSimplex", "fractions_of", "whole_rows"]


def fractions_of(values: Any) -> tuple[Fraction, ...]:
    """Return finite floats, or fractions, as the fractions that they are."""
    return tuple(Fraction(v) for v in values)


def whole_rows(A: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray, list[int]]:
    """Return rows of floats ``(m, n)``, right sides ``(m,)``, times powers of two, as ints.

    Each row is multiplied by a positive number of its own, the least that makes it whole; these
    come last.
    """
    rows = np.empty(A.shape, dtype=object)
    sides = np.empty(len(b), dtype=object)
    factors = []
    for i, (row, side) in enumerate(zip(A.tolist(), b.tolist(), strict=True)):
        pairs = [value.as_integer_ratio() for value in (*row, side)]
        denominator = max(pair[1] for pair in pairs)
        whole = [top * (denominator // bottom) for top, bottom in pairs]
        rows[i], sides[i] = whole[:-1], whole[-1]
        factors.append(denominator)
    return rows, sides, factors


class RationalSimplex:
    """A set ``A x <= b``, the first rows equations, and a walk on it.

    ``X / q`` is the point, ``adjugate / determinant`` the inverse of the basis, whose places hold
    rows or, where ``basis`` is -1, unit vectors.
    """

    def __init__(self, A: np.ndarray, b: np.ndarray, num_equalities: int) -> None:
        self.A, self.b, self._factors = whole_rows(A, b)
        self.num_equalities = num_equalities
        self.restart(np.zeros(A.shape[1]))

    def restart(self, x: np.ndarray) -> None:
        """Forget the basis, and stand at x ``(n,)``."""
        n = self.A.shape[1]
        self.basis = [-1] * n
        self.adjugate = np.zeros((n, n), dtype=object)
        for j in range(n):
            self.adjugate[j, j] = 1
        self.determinant = 1
        self.stand_at(fractions_of(x))

    def stand_at(self, x: tuple[Fraction, ...]) -> None:
        """Stand at a point ``(n,)``, and keep the basis."""
        self.q = math.lcm(*(v.denominator for v in x))
        self.X = np.array([v.numerator * (self.q // v.denominator) for v in x], dtype=object)

    def point(self) -> tuple[Fraction, ...]:
        """Return its present vertex."""
        return tuple(Fraction(v, self.q) for v in self.X)

    def slacks(self) -> np.ndarray:
        """Return ``b - A x`` ``(m,)``, each times a positive number."""
        return self.b * self.q - self.A @ self.X

    def is_inside(self) -> bool:
        """Tell whether the point fulfils all rows."""
        slacks = self.slacks()
        split = self.num_equalities
        return all(s == 0 for s in slacks[:split]) and all(s >= 0 for s in slacks[split:])

    def _place_for(self, row: int) -> tuple[int, Any]:
        """Return a free place of the basis that a row can take, and its weight; -1 for none."""
        weights = self.A[row] @ self.adjugate
        place, largest = -1, 0
        for j, entry in enumerate(self.basis):
            if entry < 0 and abs(weights[j]) > largest:
                place, largest = j, abs(weights[j])
        return place, weights

    def _replace(self, place: int, row: int, weights: np.ndarray) -> None:
        pivot, column = weights[place], self.adjugate[:, place].copy()
        adjugate = (pivot * self.adjugate - np.outer(column, weights)) // self.determinant
        adjugate[:, place] = column
        self.adjugate, self.determinant, self.basis[place] = adjugate, pivot, row

    def _move(self, direction: np.ndarray, top: int, bottom: int) -> None:
        """Go ``top / (q bottom)`` times the direction."""
        if bottom < 0:
            top, bottom = -top, -bottom
        X, q = self.X * bottom + direction * top, self.q * bottom
        divisor = math.gcd(q, *X)
        self.X, self.q = X // divisor, q // divisor

    def enter(self, row: int) -> bool:
        """Let a row take a place that no row has; False where it depends on those that have."""
        place, weights = self._place_for(row)
        if place >= 0:
            self._replace(place, row, weights)
        return place >= 0

    def _entries_of(self, row: int) -> tuple[int, int]:
        """Return a row's number of entries, and itself: with few first, numbers stay small."""
        return int(np.count_nonzero(self.A[row])), row

    def load_basis(self, basis: np.ndarray, x: np.ndarray) -> bool:
        """Take these rows as basis and the point where they meet; tell whether they do in one.

        Where places are -1 the point has the coordinates of x.
        """
        self.restart(x)
        for row in sorted((int(i) for i in basis if i >= 0), key=self._entries_of):
            if not self.enter(row):
                return False
        # Of the basis's places only those with rows ask for a move.
        rest = np.array(
            [0 if i < 0 else self.b[i] * self.q - self.A[i] @ self.X for i in self.basis],
            dtype=object,
        )
        self._move(self.adjugate @ rest, 1, self.determinant)
        return True

    def enter_equalities(self) -> dict[int, Fraction] | None:
        """Fulfil the equations. Where they contradict each other, return weights that show it.

        The weighted sum of the equations has no variables and a negative right side.
        """
        for row in range(self.num_equalities):
            place, weights = self._place_for(row)
            rest = self.b[row] * self.q - self.A[row] @ self.X
            if place >= 0:
                # The basis after it has the pivot for its determinant and the same column.
                column = self.adjugate[:, place]
                self._move(column, rest, weights[place])
                self._replace(place, row, weights)
            elif rest != 0:
                sign = -1 if rest > 0 else 1
                found = {row: Fraction(sign)}
                for j, entry in enumerate(self.basis):
                    if entry >= 0 and weights[j] != 0:
                        found[entry] = Fraction(-sign * weights[j], self.determinant)
                return found
        return None

    def multipliers(self, c: np.ndarray) -> dict[int, Fraction] | None:
        """Return y with ``c = y . rows`` for the basis, None where it has none with signs right.

        Multipliers of inequalities are not negative, and unit vectors have none.
        """
        totals = c @ self.adjugate
        found = {}
        for entry, total in zip(self.basis, totals, strict=True):
            if total == 0:
                continue
            value = Fraction(total, self.determinant)
            if entry < 0 or (entry >= self.num_equalities and value < 0):
                return None
            found[entry] = value
        return found

    def weights_of_rows(self, multipliers: dict[int, Fraction]) -> dict[int, Fraction]:
        """Return multipliers of whole rows as those of the rows that were given."""
        return {i: y * self._factors[i] for i, y in multipliers.items()}

    def bound(self, multipliers: dict[int, Fraction]) -> Fraction:
        """Return the weighted sum of right sides: no point has a larger ``c . x``."""
        return sum((y * self.b[i] for i, y in multipliers.items()), Fraction(0))

    def climb(
        self, c: np.ndarray, enough: tuple[int, int] | None = None
    ) -> dict[int, Fraction] | np.ndarray | None:
        """Walk from a point of the set to where ``c . x`` is largest; c ``(n,)`` is whole.

        Returns the multipliers that show that it is, a direction ``(n,)`` that leads up for ever,
        or None as soon as ``c . x`` is ``enough``: at least the first number, a fraction of the
        second's denominator.
        """
        while True:
            if enough is not None and (c @ self.X) * enough[1] >= enough[0] * self.q:
                return None
            place = self._edge_up(c)
            if place < 0:
                found = self.multipliers(c)
                assert found is not None
                return found
            sign = 1 if self.determinant > 0 else -1
            if self.basis[place] >= 0 or c @ self.adjugate[:, place] * sign < 0:
                sign = -sign
            direction = self.adjugate[:, place] * sign
            slopes, slacks = self.A @ direction, self.slacks()
            row = -1
            for i in range(self.num_equalities, len(slopes)):
                if slopes[i] > 0 and (
                    row < 0 or slacks[i] * slopes[row] < slacks[row] * slopes[i]
                ):
                    row = i
            if row < 0:
                return direction
            self._move(direction, slacks[row], slopes[row])
            self._replace(place, row, self.A[row] @ self.adjugate)

    def _edge_up(self, c: np.ndarray) -> int:
        """Return the place whose row to leave: a unit vector's, else that of the lowest row."""
        totals = c @ self.adjugate
        place, lowest = -1, len(self.b)
        for j, entry in enumerate(self.basis):
            if entry < 0:
                if totals[j] != 0:
                    return j
            elif entry >= self.num_equalities:
                leads_up = totals[j] < 0 if self.determinant > 0 else totals[j] > 0
                if leads_up and entry < lowest:
                    place, lowest = j, entry
        return place
