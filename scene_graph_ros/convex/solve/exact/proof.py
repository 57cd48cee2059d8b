"""Proofs of answers, and how floats' proposals become exact."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from scene_graph_ros.convex.solve.exact.rational_simplex import RationalSimplex
from scene_graph_ros.convex.solve.exact.rows import Rows
from scene_graph_ros.convex.solve.floats.active_set import climb, columns_of

__all__ = ["Proof", "as_given", "fresh_basis", "in_order", "two_to", "walk", "weights_of_basis"]

_STEPS_PER_ROW = 20
"""Steps of the walk in floats that are allowed for each row and variable."""


@dataclass(frozen=True)
class Proof:
    """The proof of an answer: ``kind`` says which vector it is, which is exact.

    ``point``: a point of the set. ``farkas``: weights of the rows, not negative for inequalities,
    whose sum has no variables and a negative right side. ``recession``: a direction in which the
    set goes on for ever. ``multipliers``: weights of the rows, as ``farkas``, whose sum is the
    row in question with a right side that is no larger.
    """

    kind: str
    vector: tuple[Fraction, ...]


def walk(
    A: np.ndarray,
    b: np.ndarray,
    num_equalities: int,
    c: np.ndarray,
    x: np.ndarray,
    state: tuple[np.ndarray, np.ndarray],
) -> tuple[int, np.ndarray, np.ndarray]:
    """Climb from x with a basis and its inverse; return the status, multipliers and the ray."""
    y, ray = np.zeros(len(x)), np.zeros(len(x))
    steps = _STEPS_PER_ROW * (sum(A.shape) + 1)
    status = climb(columns_of(A), b, num_equalities, len(b), c, x, *state, y, ray, steps)
    return status, y, ray


def fresh_basis(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Return a basis without rows, and its inverse."""
    return np.full(n, -1, dtype=np.int64), np.eye(n)


def in_order(weights: dict[int, Fraction], rows: Rows) -> tuple[Fraction, ...]:
    """Return weights of scaled rows as weights of all rows as they were given."""
    found = [Fraction(0)] * len(rows.b)
    for i, weight in weights.items():
        if i < len(found):
            found[i] = weight * two_to(rows.exponents[0][i])
    return tuple(found)


def two_to(exponent: int) -> Fraction:
    """Return a power of two, exactly."""
    return Fraction(2) ** int(exponent)


def as_given(x: Sequence[Fraction], rows: Rows) -> tuple[Fraction, ...]:
    """Return scaled variables as they were given."""
    return tuple(
        v * two_to(e) for v, e in zip(x, rows.exponents[1], strict=False)
    )  # without the radius


def weights_of_basis(
    A: np.ndarray, b: np.ndarray, num_equalities: int, basis: np.ndarray, goal: np.ndarray
) -> tuple[dict[int, Fraction], Fraction] | None:
    """Return exact multipliers of a basis's rows for a whole goal, and their bound of it.

    None where the basis has none with the right signs.
    """
    chosen = np.sort(basis[basis >= 0])
    alone = RationalSimplex(A[chosen], b[chosen], int((chosen < num_equalities).sum()))
    if not alone.load_basis(np.arange(len(chosen)), np.zeros(A.shape[1])):
        return None
    found = alone.multipliers(goal)
    if found is None:
        return None
    weights = {int(chosen[k]): v for k, v in alone.weights_of_rows(found).items()}
    return weights, alone.bound(found)
