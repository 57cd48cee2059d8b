"""Do sets of corners meet: the nearest difference of two, or image of one, to 0, in fractions.

The method of Wolfe ("Finding the nearest point in a polytope", 1976) keeps some differences of
corners, of which the nearest point of their affine hull is a convex combination, and adds one that
is further towards 0. Its distance falls with each step, so the steps end: at 0, which the
differences then surround, or where a plane shows that all of them are beyond it. It has as many
numbers as there are dimensions, however many corners or members the sets have. Floats choose the
first differences.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
import math

import numpy as np

from scene_graph_ros.convex.solve.exact.corners import (
    Corners,
    Points,
    with_unit,
)
from scene_graph_ros.convex.solve.nearest.nearest_in_hull import nearest_in_hull
from scene_graph_ros.geometry.spatial.sums import product

__all__ = ["corners_meet", "corners_meet_ball"]

_ROUNDS = 100
"""Of floats: they end sooner, where a further corner brings nothing."""

_GAIN = 1e-13
"""Relative: what a further corner must bring in floats."""


Furthest = Callable[[np.ndarray], np.ndarray]
"""The furthest corner ``(n,)`` of a set along a direction, both of whole numbers."""


def corners_meet(one: Corners, other: Corners) -> bool:
    """Tell whether two sets have a point in common, exactly."""
    unit = with_unit(one, other)

    def furthest(d: np.ndarray) -> np.ndarray:
        difference: np.ndarray = one.along(d, unit)[1] - other.along(-d, unit)[1]
        return difference

    def nearly(d: np.ndarray) -> np.ndarray:
        difference: np.ndarray = one.nearly(d)[1] - other.nearly(-d)[1]
        return difference

    first = _first_choice(nearly, furthest, next(one.numbers()).shape[1])
    return _comes_within(furthest, first, 0)


def corners_meet_ball(one: Corners, A: np.ndarray, center: np.ndarray) -> bool:
    """Tell whether a set has a point x with ``A (x - center)`` no longer than 1, exactly.

    ``A`` is ``(k, n)`` of finite numbers, ``center`` ``(n,)``.
    """
    form, middle = Points(A), Points(center[np.newaxis])
    unit, of_form = with_unit(one, middle), with_unit(form)
    (moved,), rows = middle.whole(unit), form.whole(of_form)

    def furthest(d: np.ndarray) -> np.ndarray:
        image: np.ndarray = rows @ (one.along(rows.T @ d, unit)[1] - moved)
        return image

    def nearly(d: np.ndarray) -> np.ndarray:
        return product(A, one.nearly(product(A.T, d))[1] - center)

    return _comes_within(furthest, _first_choice(nearly, furthest, len(A)), unit * of_form)


def _comes_within(furthest: Furthest, kept: list[np.ndarray], radius: int) -> bool:
    """Tell whether the hull of corners comes within a whole number of 0, from some of them."""
    weights = [Fraction(1, len(kept))] * len(kept)
    while True:
        kept, weights = _nearest(kept, weights)
        x, denominator = _combined(kept, weights)
        square = x @ x
        if square <= (radius * denominator) ** 2:
            return True
        found = furthest(-x)
        ahead = found @ x
        if ahead > 0 and ahead * ahead > radius * radius * square:
            return False
        kept, weights = [*kept, found], [*weights, Fraction(0)]


def _first_choice(nearly: Furthest, furthest: Furthest, n: int) -> list[np.ndarray]:
    """Return differences of which none is in the affine hull of others, chosen by floats.

    ``nearly`` returns the furthest ones in floats.
    """
    ways = [np.eye(n)[0]]
    points = nearly(ways[0])[np.newaxis]
    weights = np.ones(1)
    for _ in range(_ROUNDS):
        _, found, failed = nearest_in_hull(points, np.zeros((1, n)))
        if failed >= 0 or not found.sum() > 0.0:
            break
        weights = found[0] / found[0].sum()
        x = product(weights, points)
        square, length = float(product(x, x)), float(np.abs(x).max())
        if not square > 0.0:
            break
        ahead = nearly(-x / length)
        gain = square - float(product(x, ahead))
        if gain <= _GAIN * (square + float(product(np.abs(x), np.abs(ahead)))):
            break
        if (points == ahead).all(axis=1).any():
            break
        ways.append(-x / length)
        points = np.concatenate([points, ahead[np.newaxis]])
        weights = np.append(weights, 0.0)
    # Those that matter most come first.
    order = np.argsort(-weights, kind="stable")
    chosen = [k for k in order if weights[k] > 0.0] or [0]
    return _independent([furthest(_whole_direction(ways[k])) for k in chosen])


def _whole_direction(d: np.ndarray) -> np.ndarray:
    """Return a direction of floats as whole numbers, to 53 bits of the largest."""
    scaled = np.ldexp(d, 53 - int(np.frexp(np.abs(d).max())[1]))
    return np.array([int(v) for v in scaled], dtype=object)


def _independent(points: list[np.ndarray]) -> list[np.ndarray]:
    """Return the first points of which none is in the affine hull of those before."""
    kept = [points[0]]
    rows: list[tuple[int, list[Fraction]]] = []
    for each in points[1:]:
        way = [Fraction(v) for v in each - points[0]]
        for pivot, row in rows:
            factor = way[pivot] / row[pivot]
            way = [a - factor * b for a, b in zip(way, row, strict=True)]
        first = next((k for k, v in enumerate(way) if v), None)
        if first is not None:
            rows.append((first, way))
            kept.append(each)
    return kept


def _nearest(
    kept: list[np.ndarray], weights: list[Fraction]
) -> tuple[list[np.ndarray], list[Fraction]]:
    """Return fewer points and weights above 0, of their affine hull's nearest point to 0."""
    while True:
        best = _affine_weights(kept)
        if all(w >= 0 for w in best):
            pairs = [(p, w) for p, w in zip(kept, best, strict=True) if w]
            return [p for p, _ in pairs], [w for _, w in pairs]
        share = min(w / (w - to) for w, to in zip(weights, best, strict=True) if to < 0)
        moved = [w + share * (to - w) for w, to in zip(weights, best, strict=True)]
        pairs = [(p, w) for p, w in zip(kept, moved, strict=True) if w]
        kept, weights = [p for p, _ in pairs], [w for _, w in pairs]


def _affine_weights(kept: list[np.ndarray]) -> list[Fraction]:
    """Return the weights, which sum to 1, of the nearest point to 0 of an affine hull.

    The points are affinely independent. Elimination without fractions (Bareiss 1968).
    """
    ways = np.array([each - kept[0] for each in kept[1:]], dtype=object).reshape(
        len(kept) - 1, len(kept[0])
    )
    m = len(ways)
    rows = [[*(ways @ way).tolist(), -int(way @ kept[0])] for way in ways]
    last = 1
    for k in range(m):
        pivot = rows[k][k]
        for i in range(m):
            if i != k:
                factor = rows[i][k]
                rows[i] = [
                    (pivot * a - factor * b) // last for a, b in zip(rows[i], rows[k], strict=True)
                ]
        last = pivot
    others = [Fraction(int(rows[k][m]), int(rows[k][k])) for k in range(m)]
    return [1 - sum(others, Fraction(0)), *others]


def _combined(kept: list[np.ndarray], weights: list[Fraction]) -> tuple[np.ndarray, int]:
    """Return the weighted sum ``(n,)`` as whole numbers, and what they are to be divided by."""
    denominator = math.lcm(*(w.denominator for w in weights))
    shares = [w.numerator * (denominator // w.denominator) for w in weights]
    total = np.sum([share * p for share, p in zip(shares, kept, strict=True)], axis=0)
    common = math.gcd(denominator, *(int(v) for v in total))
    return np.asarray(total // common), denominator // common
