"""How large ``c . x`` is on a polyhedron: in floats with its gap, and as a proven bound."""

from __future__ import annotations

from dataclasses import dataclass
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
    fractions_of,
    RationalSimplex,
)
from scene_graph_ros.convex.solve.exact.rows import is_inside, Rows
from scene_graph_ros.convex.solve.floats.active_set import (
    columns_of,
    enter_equalities,
    UNBOUNDED,
)
from scene_graph_ros.geometry.spatial.sums import least_squares, product
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = ["Optimum", "maximize", "prove_bound"]


@dataclass(frozen=True)
class Optimum:
    """The largest ``c . x``, in floats: infinite, with the direction as ``ray``, if unbounded.

    ``upper`` is its bound by the multipliers ``y (m,)``; ``gap`` the difference, which
    includes by how much x is outside and y is off, each at most once.
    """

    value: float
    x: np.ndarray
    y: np.ndarray
    upper: float
    gap: float
    ray: np.ndarray | None
    basis: np.ndarray


_ROUNDING = 16.0 * EPSILON
"""Relative to the largest multiplier: one below zero that is rounding."""


def _mend_signs(
    A: np.ndarray, goal: np.ndarray, num_equalities: int, chosen: np.ndarray, y: np.ndarray
) -> None:
    """Let no inequality's multiplier be negative; the others make up for it as far as they can.

    Which of nearly parallel rows to leave no slope tells the walk: one may have a multiplier below
    zero that is no rounding. Without that row its neighbours fit nearly as well.
    """
    signed = y[num_equalities:]
    signed[(signed < 0.0) & (signed >= -_ROUNDING * np.abs(y).max(initial=0.0))] = 0.0
    while (signed < 0.0).any():
        worst = num_equalities + int(signed.argmin())
        chosen = chosen[chosen != worst]
        y[worst] = 0.0
        for _ in range(2):
            left = goal - product(y[chosen], A[chosen])
            y[chosen] += least_squares(A[chosen].T, left, max(A.shape) * EPSILON)


def maximize(rows: Rows, c: np.ndarray, start: np.ndarray) -> Optimum:
    """Return the largest ``c . x`` over a set, from a point ``(n,)`` of it, in floats."""
    A, b = rows.scaled
    scales = rows.exponents
    goal = np.ldexp(c, scales[1])
    x = np.ldexp(start, -scales[1])
    state = fresh_basis(len(x))
    enter_equalities(columns_of(A), b, rows.num_equalities, x, *state)
    status, weights, ray = walk(A, b, rows.num_equalities, goal, x, state)
    point = np.ldexp(x, scales[1])
    places, inverse = state
    named = places >= 0
    for _ in range(2):
        # Rows that are nearly parallel have large multipliers; once more takes what rounding left.
        left = goal - product(weights[named], A[places[named]])
        left[~named] -= weights[~named]
        weights = weights + product(left, inverse)
    y = np.zeros(len(b))
    y[places[named]] = weights[named]
    if status != UNBOUNDED:
        _mend_signs(A, goal, rows.num_equalities, places[named], y)
    y = np.ldexp(y, scales[0])
    if status == UNBOUNDED:
        direction = np.ldexp(ray, scales[1])
        return Optimum(np.inf, point, y, np.inf, 0.0, direction, state[0])
    # About the point, so that a set far from the origin loses nothing.
    slack = rows.b - product(rows.A, point)
    value = float(product(c, point))
    off = product(np.abs(c - product(y, rows.A)), np.maximum(np.abs(point), np.abs(start)))
    gap = float(abs(product(y, slack)) + off)
    return Optimum(value, point, y, value + gap, gap, None, state[0])


_INWARD = (0.0, 1e-14, 1e-12, 1e-9, 1e-6, 1e-3)
"""Shares of the way from an optimum back to an inner point: rounding leaves corners outside."""


def _witness(
    rows: Rows, c: np.ndarray, bound: Fraction, inner: np.ndarray, optimum: Optimum
) -> np.ndarray | None:
    """Return a point of floats of the set, with ``c . x`` above a bound; None if none is near."""
    if not optimum.value > bound:
        return None
    far = optimum.x
    if optimum.ray is not None:
        missing = max(0.0, float(bound) - float(product(c, inner)))
        far = inner + optimum.ray * (2.0 * missing / float(product(c, optimum.ray)) + 1.0)
    for share in _INWARD:
        x = far + share * (inner - far)
        if is_inside(rows, x):
            height = sum(
                (Fraction(a) * Fraction(v) for a, v in zip(c, x, strict=True)), Fraction(0)
            )
            return x if height > bound else None
    return None


def prove_bound(rows: Rows, c: np.ndarray, bound: Fraction, start: Proof) -> Proof:
    """Decide whether ``c . x <= bound`` for all points of the set.

    ``start`` is a point of it. Returns multipliers that show it, or a point where ``c . x`` is
    larger.
    """
    inner = np.array([float(v) for v in start.vector])
    optimum = maximize(rows, c, inner)
    witness = _witness(rows, c, bound, inner, optimum)
    if witness is not None:
        return Proof("point", fractions_of(witness))
    scaled = fractions_of(np.ldexp(c, rows.exponents[1]))
    denominator = max((v.denominator for v in scaled), default=1)
    whole = np.array([int(v * denominator) for v in scaled], dtype=object)
    limit = bound * denominator
    found = weights_of_basis(*rows.scaled, rows.num_equalities, optimum.basis, whole)
    if found is not None and found[1] <= limit:
        weights = {k: v / denominator for k, v in found[0].items()}
        return Proof("multipliers", in_order(weights, rows))
    exact = RationalSimplex(*rows.scaled, rows.num_equalities)
    x = np.ldexp(optimum.x, -rows.exponents[1])
    if not (exact.load_basis(optimum.basis, x) and exact.is_inside()):
        exact.restart(np.zeros(len(c)))
        exact.stand_at(
            tuple(v / two_to(e) for v, e in zip(start.vector, rows.exponents[1], strict=True))
        )
        exact.enter_equalities()
    answer = exact.climb(whole)
    assert answer is not None  # nothing is enough
    if isinstance(answer, dict) and exact.bound(answer) <= limit:
        weights = {k: v / denominator for k, v in exact.weights_of_rows(answer).items()}
        return Proof("multipliers", in_order(weights, rows))
    point = exact.point()
    if not isinstance(answer, dict):
        # Far enough along the direction that the bound is passed.
        rate = sum(a * d for a, d in zip(whole, answer, strict=True))
        height = sum(a * v for a, v in zip(whole, point, strict=True))
        step = max(Fraction(0), limit - height) / rate + 1
        point = tuple(v + step * d for v, d in zip(point, answer, strict=True))
    return Proof("point", as_given(point, rows))
