"""Is there a point: the largest ball within rows, or weights that show that there is none.

Floats propose (`active_set`), on rows and variables scaled by powers of two, which changes
nothing. The deciding proof is checked exactly: a point against all rows, multipliers by solving
for them in rational arithmetic. Where the proposed basis does not prove its claim, the rational
simplex method goes on from it. So the answer is true of the numbers given.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from scene_graph_ros.convex.solve.exact.proof import (
    as_given,
    fresh_basis,
    in_order,
    Proof,
    walk,
    weights_of_basis,
)
from scene_graph_ros.convex.solve.exact.rational_simplex import (
    fractions_of,
    RationalSimplex,
)
from scene_graph_ros.convex.solve.exact.rows import is_inside, Rows
from scene_graph_ros.convex.solve.exact.sifting import find_by_few, weights_of
from scene_graph_ros.convex.solve.floats.active_set import (
    columns_of,
    enter_equalities,
)
from scene_graph_ros.geometry.spatial.sums import product

__all__ = ["Deepest", "exact_point", "find_deepest", "find_point"]


@dataclass(frozen=True)
class Deepest:
    """The point furthest from all inequalities, in floats: ``x (n,)`` and how far it is.

    The distance is negative where there is no point, and at most ``cap``.
    """

    x: np.ndarray
    radius: float
    gap: float
    basis: np.ndarray
    cap: float


def _with_radius(rows: Rows, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Return the scaled rows with the ball's radius as last variable, and its cap as last row."""
    A, b = rows.scaled
    m, n = A.shape
    # No ball between rows is larger than the largest right side of a row of unit length.
    counts = weights > 0.0
    cap = 2.0 * float((np.abs(b[counts]) / weights[counts]).max(initial=0.0)) or 1.0
    extended = np.zeros((m + 1, n + 1))
    extended[:m, :n], extended[:m, n] = A, weights
    extended[m, n] = 1.0
    return extended, np.append(b, cap), cap


def _weights(rows: Rows) -> np.ndarray:
    """Return the cost of a unit of radius in each scaled inequality, none in equations.

    A row without variables that holds takes nothing, one that doesn't counts as a length of 1.
    """
    A, b = rows.scaled
    # The length of the row as it was given, times its factor: the radius isn't scaled.
    lengths = np.linalg.norm(np.ldexp(A, -rows.exponents[1]), axis=1)
    lengths = np.where((lengths == 0.0) & (b < 0.0), 1.0, lengths)
    lengths[: rows.num_equalities] = 0.0
    return lengths


def find_deepest(rows: Rows, start: np.ndarray | None = None) -> Deepest:
    """Return the centre of the largest ball within the inequalities and on the equations.

    Euclidean distance in the variables as they were given; ``start (n,)`` is a guess.
    """
    A, b, cap = _with_radius(rows, _weights(rows))
    n = A.shape[1] - 1
    x = np.zeros(n + 1)
    if start is not None:
        x[:n] = np.ldexp(start, -rows.exponents[1])
    state = fresh_basis(n + 1)
    enter_equalities(columns_of(A), b, rows.num_equalities, x, *state)
    split = rows.num_equalities
    slack = b[split:] - product(A[split:, :n], x[:n])
    weights = A[split:, n]
    x[n] = min(slack[weights > 0.0] / weights[weights > 0.0])
    c = np.zeros(n + 1)
    c[n] = 1.0
    _, y, _ = walk(A, b, rows.num_equalities, c, x, state)
    basis = state[0]
    upper = sum(y[j] * b[i] for j, i in enumerate(basis) if i >= 0)
    return Deepest(np.ldexp(x[:n], rows.exponents[1]), x[n], abs(upper - x[n]), basis, cap)


def exact_point(rows: Rows, x: np.ndarray) -> tuple[Fraction, ...] | None:
    """Return x, moved onto the equations exactly; None where an inequality doesn't allow it."""
    if is_inside(rows, x):
        return fractions_of(x)
    if not rows.num_equalities:
        return None
    exact = RationalSimplex(*rows.scaled, rows.num_equalities)
    exact.restart(np.ldexp(x, -rows.exponents[1]))
    if exact.enter_equalities() is None and exact.is_inside():
        return as_given(exact.point(), rows)
    return None


def find_point(rows: Rows) -> Proof:
    """Return a point of the set, or weights that show that there is none (Farkas 1902)."""
    weights = weights_of(rows)
    return _find_in_all(rows) if weights is None else find_by_few(rows, weights, _find_in_all)


def _find_in_all(rows: Rows) -> Proof:
    deepest = find_deepest(rows)
    if deepest.radius >= 0.0 or rows.num_equalities:
        point = exact_point(rows, deepest.x)
        if point is not None:
            return Proof("point", point)
    return _find_exactly(rows, deepest)


def _find_exactly(rows: Rows, deepest: Deepest) -> Proof:
    A, b, _ = _with_radius(rows, _weights(rows))
    n = A.shape[1] - 1
    split = rows.num_equalities
    c = np.array([0] * n + [1], dtype=object)
    found = weights_of_basis(A, b, split, deepest.basis, c)
    if found is not None and found[1] < 0:
        return Proof("farkas", in_order(found[0], rows))
    exact = RationalSimplex(A, b, split)
    x = np.append(np.ldexp(deepest.x, -rows.exponents[1]), deepest.radius)
    if not (exact.load_basis(deepest.basis, x) and exact.is_inside()):
        exact.restart(x)
        contradiction = exact.enter_equalities()
        if contradiction is not None:
            return Proof("farkas", in_order(exact.weights_of_rows(contradiction), rows))
        point = exact.point()
        slacks = exact.b - exact.A[:, :n] @ np.array(point[:n], dtype=object)
        takes = exact.A[:, n]
        radius = min(Fraction(s, t) for s, t in zip(slacks, takes, strict=True) if t > 0)
        exact.stand_at((*point[:n], radius))
    answer = exact.climb(c, enough=(0, 1))
    if answer is None:
        return Proof("point", as_given(exact.point(), rows))
    assert isinstance(answer, dict)  # the cap's row ends every walk
    return Proof("farkas", in_order(exact.weights_of_rows(answer), rows))
