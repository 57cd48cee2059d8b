"""Points, and optima, of rows and balls: each ball is cut out by planes, more where it matters.

A cut ``u . w <= t`` with ``|u| <= 1`` holds in the ball ``|w| <= t``. The centre of the largest
ball within rows and cuts is asked; where it is outside a ball, a cut through it is added (Elzinga
and Moore, "A central cutting plane algorithm", 1975). For optima the best point is cut off instead
(Kelley 1960), and what is inside on the way to it counts. Rows and cuts together are linear, so
that what is proven of them is exact.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from scene_graph_ros.geometry.optimization.lift import Ball, Lift
from scene_graph_ros.geometry.optimization.solve.feasibility import (
    exact_point,
    find_deepest,
    find_point,
)
from scene_graph_ros.geometry.optimization.solve.maximize import maximize
from scene_graph_ros.geometry.optimization.solve.rows import Rows
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = [
    "Cut",
    "Found",
    "Reached",
    "find_in_balls",
    "maximize_in_balls",
    "rows_with_cuts",
    "tangent_cuts",
]

_MOST_ROUNDS = 300
"""Rounds of cutting; a set whose width shrinks by a tenth in each is then below rounding."""

_CLOSE = 1e-11
"""Relative to a ball's radius: a point outside by less can't be told from one on it for long."""

_GAP = 1e-11
"""Relative to the first gap of an optimum: where cutting ends."""

_MOST_IDLE = 10
"""Rounds in a row that took less than a tenth of the gap away: rounding is what is left."""

_ROUNDING = 16.0 * EPSILON
"""Relative to an optimum: a gap that is rounding."""


@dataclass(frozen=True, eq=False)
class Cut:
    """The plane ``u . w <= scale`` of a ball, ``u (k,)`` no longer than 1."""

    ball: int
    u: np.ndarray


@dataclass(frozen=True)
class Found:
    """``point`` or ``farkas`` with its exact vector, of the rows and then the cuts.

    ``undecided``: the vector is a point, outside the balls by ``gap`` of their radii.
    """

    kind: str
    vector: tuple[Fraction, ...]
    cuts: tuple[Cut, ...]
    gap: float


@dataclass(frozen=True)
class Reached:
    """The largest ``c . x`` found, at a point inside, and a bound that no point exceeds.

    ``size`` is by how much the first bound was above the first point.
    """

    value: float
    x: np.ndarray
    upper: float
    ray: np.ndarray | None
    size: float = 0.0


def _unit(w: np.ndarray) -> np.ndarray:
    """Return a vector of at most unit length, as exactly as floats can say."""
    u = w / np.linalg.norm(w)
    return u * (1.0 - 4.0 * len(u) * EPSILON)


def _first_cuts(balls: Sequence[Ball]) -> list[Cut]:
    """Return the box around each ball."""
    return [
        Cut(k, sign * e)
        for k, ball in enumerate(balls)
        for sign in (1.0, -1.0)
        for e in np.eye(len(ball.columns))
    ]


def rows_with_cuts(lift: Lift, cuts: Sequence[Cut]) -> Rows:
    """Return the rows of a lift and those of the cuts behind them."""
    A = np.zeros((len(cuts), lift.num_variables))
    b = np.zeros(len(cuts))
    for row, cut in enumerate(cuts):
        ball = lift.balls[cut.ball]
        A[row, ball.columns] = cut.u
        if ball.scale < 0:
            b[row] = 1.0
        else:
            A[row, ball.scale] = -1.0
    rows = lift.rows
    return Rows(np.concatenate([rows.A, A]), np.append(rows.b, b), rows.num_equalities)


def _radius(ball: Ball, x: np.ndarray) -> float:
    return 1.0 if ball.scale < 0 else float(x[ball.scale])


def _excess(ball: Ball, x: np.ndarray) -> float:
    """Return how far a point is outside a ball, beside a radius of 1 or less."""
    return float(np.linalg.norm(x[ball.columns])) - _radius(ball, x)


def _new_cuts(balls: Sequence[Ball], x: np.ndarray, least: float = 0.0) -> list[Cut]:
    return [
        Cut(k, _unit(x[ball.columns]))
        for k, ball in enumerate(balls)
        if _excess(ball, x) > least * abs(_radius(ball, x)) and x[ball.columns].any()
    ]


def tangent_cuts(balls: Sequence[Ball], x: np.ndarray) -> list[Cut]:
    """Return the planes of balls on the side of a point ``(k,)``, wherever it is."""
    return _new_cuts(balls, x, -np.inf)


def _is_in_balls(balls: Sequence[Ball], x: Sequence[Fraction]) -> bool:
    for ball in balls:
        radius = Fraction(1) if ball.scale < 0 else x[ball.scale]
        if radius < 0 or sum(x[k] ** 2 for k in ball.columns) > radius**2:
            return False
    return True


def find_in_balls(lift: Lift, first: Sequence[Cut] = ()) -> Found:
    """Return a point of a lift, proof that there is none, or that neither was found.

    ``first`` are cuts to begin with, of whoever knows where it matters.
    """
    if not lift.balls:
        proof = find_point(lift.rows)
        return Found(proof.kind, proof.vector, (), 0.0)
    cuts, best = [*_first_cuts(lift.balls), *first], np.inf
    x_best = np.zeros(lift.num_variables)
    for _ in range(_MOST_ROUNDS):
        rows = rows_with_cuts(lift, cuts)
        deepest = find_deepest(rows)
        x = deepest.x
        if deepest.radius <= 0.0:
            proof = find_point(rows)
            if proof.kind == "farkas" or _is_in_balls(lift.balls, proof.vector):
                return Found(proof.kind, proof.vector, tuple(cuts), 0.0)
            x = np.array([float(v) for v in proof.vector])
        excess = max(_excess(ball, x) for ball in lift.balls)
        if excess <= 0.0:
            point = exact_point(rows, x)
            if point is None:
                proof = find_point(rows)
                if proof.kind == "farkas":
                    return Found(proof.kind, proof.vector, tuple(cuts), 0.0)
                point = proof.vector
            if _is_in_balls(lift.balls, point):
                return Found("point", point, tuple(cuts), 0.0)
        if excess < best:
            best, x_best = excess, x
        if best <= _CLOSE and deepest.radius <= _CLOSE * deepest.cap:
            break
        added = _new_cuts(lift.balls, x, -_CLOSE)
        if not added:
            break
        cuts += added
    vector = tuple(Fraction(v) for v in x_best.tolist())
    return Found("undecided", vector, tuple(cuts), max(best, 0.0))


def _way_inside(balls: Sequence[Ball], inner: np.ndarray, outer: np.ndarray) -> float:
    """Return the share of the way to an outer point at which the first ball ends."""
    share = 1.0
    for ball in balls:
        w, dw = inner[ball.columns], (outer - inner)[ball.columns]
        r = 1.0 if ball.scale < 0 else inner[ball.scale]
        dr = 0.0 if ball.scale < 0 else (outer - inner)[ball.scale]
        # |w + s dw|^2 = (r + s dr)^2, whose constant term is negative.
        a, b, c = dw @ dw - dr * dr, dw @ w - dr * r, w @ w - r * r
        if a <= 0.0 and b <= 0.0:
            continue
        root = b * b - a * c
        if root < 0.0:
            continue
        root = np.sqrt(root)
        at = -c / (b + root) if b >= 0.0 else (root - b) / a
        if at >= 0.0:
            share = min(share, at)
    return share


def maximize_in_balls(
    lift: Lift, c: np.ndarray, inner: np.ndarray, cuts: Sequence[Cut]
) -> Reached:
    """Return the largest ``c . x``, from a point inside, until the bound is near."""
    cuts, best = list(cuts), Reached(float(c @ inner), inner, np.inf, None)
    size, idle = 0.0, 0
    for _ in range(_MOST_ROUNDS):
        optimum = maximize(rows_with_cuts(lift, cuts), c, inner)
        if optimum.ray is not None:
            return Reached(np.inf, inner, np.inf, optimum.ray)
        share = _way_inside(lift.balls, inner, optimum.x)
        x = inner + share * (optimum.x - inner)
        value = float(c @ x)
        size = size or max(0.0, optimum.upper - best.value)
        upper = min(best.upper, optimum.upper)
        improvement = (best.upper - best.value) - (upper - max(value, best.value))
        idle = 0 if improvement > 0.1 * (upper - max(value, best.value)) else idle + 1
        if value > best.value:
            best = Reached(value, x, upper, None, size)
        else:
            best = Reached(best.value, best.x, upper, None, size)
        is_near = upper - best.value <= _GAP * size + _ROUNDING * abs(upper)
        if is_near or idle > _MOST_IDLE:
            break
        added = _new_cuts(lift.balls, optimum.x) + _new_cuts(lift.balls, x, -1e-9)
        if not added:
            break
        cuts += added
    return best
