"""Does a polyhedron go on for ever: a direction, or weights that show that it doesn't."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from scene_graph_ros.convex.solve.exact.proof import (
    as_given,
    fresh_basis,
    in_order,
    Proof,
    two_to,
    walk,
    weights_of_basis,
)
from scene_graph_ros.convex.solve.exact.rational_simplex import (
    RationalSimplex,
    whole_rows,
)
from scene_graph_ros.convex.solve.exact.rows import Rows
from scene_graph_ros.convex.solve.floats.active_set import (
    columns_of,
    enter_equalities,
)

__all__ = ["recession"]


def recession(rows: Rows) -> Proof:
    """Decide whether a direction leads on for ever: ``A d <= 0``, equations 0, d not 0.

    Returns it, or multipliers, all of them positive for inequalities, whose weighted sum of rows
    has no variables: then ``A d <= 0`` means ``A d = 0`` (Stiemke 1915), and the rows span space.
    Both are about the rows alone; the right sides play no part.
    """
    A, _ = rows.scaled
    split = rows.num_equalities
    m, n = A.shape
    total = A[split:].sum(axis=0)
    # Right sides that are all different let no two rows meet the way at once.
    sides = np.where(np.arange(m) < split, 0.0, 1.0 + np.modf(np.arange(m) * 0.6180339887)[0])
    x = np.zeros(n)
    state = fresh_basis(n)
    enter_equalities(columns_of(A), sides, split, x, *state)
    walk(A, sides, split, -total, x, state)
    sums, denominator = _whole_sum(A[split:])
    goal = -sums
    found = weights_of_basis(A, sides, split, state[0], goal)
    if found is None or -1 in state[0]:
        exact = RationalSimplex(A, sides, split)
        if not (exact.load_basis(state[0], x) and exact.is_inside()):
            exact.restart(np.zeros(n))
            exact.enter_equalities()
        answer = exact.climb(goal)
        assert answer is not None  # nothing is enough
        if not isinstance(answer, dict):
            way = as_given(tuple(Fraction(v) for v in answer), rows)
            return Proof("recession", _of_size_one(way))
        line = _free_direction(exact)
        if line is not None:
            return Proof("recession", _of_size_one(as_given(line, rows)))
        found = exact.weights_of_rows(answer), exact.bound(answer)
    weights = {i: Fraction(1) for i in range(split, m)}
    for i, weight in found[0].items():
        weights[i] = weights.get(i, Fraction(0)) + weight / denominator
    return Proof("multipliers", in_order(weights, rows))


def _of_size_one(way: tuple[Fraction, ...]) -> tuple[Fraction, ...]:
    """Return a direction divided by a power of two: whole numbers outgrow floats."""
    largest = max(abs(v) for v in way)
    exponent = largest.numerator.bit_length() - largest.denominator.bit_length()
    return tuple(v * two_to(-exponent) for v in way)


def _whole_sum(A: np.ndarray) -> tuple[np.ndarray, int]:
    """Return the sum of rows as whole numbers ``(n,)`` over a denominator."""
    whole, _, factors = whole_rows(A.T, np.zeros(A.shape[1]))
    denominator = max(factors, default=1)
    sums = [sum(row) * (denominator // f) for row, f in zip(whole, factors, strict=True)]
    return np.array(sums, dtype=object), denominator


def _free_direction(exact: RationalSimplex) -> tuple[Fraction, ...] | None:
    """Return a direction that changes no row, None where the rows span space."""
    for row in range(len(exact.b)):
        if -1 not in exact.basis:
            return None
        if row not in exact.basis:
            exact.enter(row)
    for place, entry in enumerate(exact.basis):
        if entry < 0:
            return tuple(Fraction(v) for v in exact.adjugate[:, place])
    return None
