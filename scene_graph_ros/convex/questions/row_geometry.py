"""Rows of a polyhedron in floats: its box, distances of points, the nearest."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from scene_graph_ros.convex.questions.answers import Projection
from scene_graph_ros.convex.solve.exact.proof import two_to
from scene_graph_ros.convex.solve.exact.rows import Rows
from scene_graph_ros.convex.solve.nearest.projection import project_points
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = [
    "are_boxed",
    "are_feet_inside",
    "box_of_rows",
    "distances_outside",
    "later_twins",
    "nearest_of_rows",
]


def box_of_rows(A: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """Return the corners ``(n,)`` of a bounded box, exactly; None where rows are not those of one.

    Each is of one coordinate, times a power of two.
    """
    if np.count_nonzero(A) != len(b):
        return None
    columns = (A != 0.0).argmax(axis=1) if A.size else np.zeros(0, dtype=np.int64)
    factors = A[np.arange(len(columns)), columns]
    if len(columns) != len(b) or not (np.abs(np.frexp(factors)[0]) == 0.5).all():
        return None
    if ((A != 0.0).sum(axis=1) != 1).any():
        return None
    low, high = np.full(A.shape[1], -np.inf), np.full(A.shape[1], np.inf)
    sides, is_upper = b / factors, factors > 0.0
    np.minimum.at(high, columns[is_upper], sides[is_upper])
    np.maximum.at(low, columns[~is_upper], sides[~is_upper])
    return (low, high) if np.isfinite([low, high]).all() else None


def are_boxed(A: np.ndarray) -> bool:
    """Tell whether rows of one coordinate each bound all coordinates on both sides."""
    alone = A[(A != 0.0).sum(axis=1) == 1]
    return bool((alone > 0.0).any(axis=0).all() and (alone < 0.0).any(axis=0).all())


def distances_outside(A: np.ndarray, b: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return the distances of points ``(p, n)`` beyond the row furthest away, 0 inside.

    Infinite where a row without variables has no point.
    """
    if not len(points) or not len(b):
        return np.zeros(len(points))
    lengths = np.linalg.norm(A, axis=1)
    empty_row = lengths == 0.0
    # In place, points beside each other: arrays of this size cost more than what is in them.
    over = A @ points.T
    over -= b[:, np.newaxis]
    over /= np.where(empty_row, 1.0, lengths)[:, np.newaxis]
    over[empty_row] = np.where(b[empty_row] < 0.0, np.inf, -np.inf)[:, np.newaxis]
    result: np.ndarray = over.max(axis=0)
    return np.maximum(result, 0.0, out=result)


def are_feet_inside(A: np.ndarray, b: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Tell for which points ``(p, n)`` the nearest point of the furthest row is inside of all.

    To rounding; then that row is as far as the set.
    """
    if not len(points) or not len(b):
        return np.ones(len(points), dtype=np.bool_)
    lengths = np.linalg.norm(A, axis=1)
    lengths[lengths == 0.0] = 1.0
    over = (points @ A.T - b) / lengths
    rows = over.argmax(axis=1)
    ways = (over[np.arange(len(points)), rows] / lengths[rows])[:, np.newaxis] * A[rows]
    sizes = np.abs(points) @ np.abs(A).T + np.abs(b)
    rounding = 4.0 * (A.shape[1] + 2) * EPSILON * sizes
    return ((points - ways) @ A.T - b <= rounding).all(axis=1)


def later_twins(A: np.ndarray, b: np.ndarray) -> dict[int, tuple[int, Fraction]]:
    """Return rows that are those of others times a power of two, exactly, and no tighter.

    For each the row that stands for it, the tightest of its kind and of these the last, and the
    factor.
    """
    exponents = np.frexp(np.abs(A).max(axis=1, initial=0.0))[1]
    seen: dict[bytes, int] = {}
    # Negative zeros are zeros.
    scaled = np.ldexp(A, -exponents[:, None]) + 0.0
    kinds = [seen.setdefault(row.tobytes(), len(seen)) for row in scaled]
    if len(seen) == len(b):
        return {}
    order = np.lexsort((-np.arange(len(b)), np.ldexp(b, -exponents), np.array(kinds)))
    found, last = {}, -1
    for i in order.tolist():
        if last >= 0 and kinds[i] == kinds[last]:
            found[i] = last, two_to(exponents[i] - exponents[last])
        else:
            last = i
    return found


def _scaled(rows: Rows) -> tuple[np.ndarray, np.ndarray]:
    """Return inequalities times powers of two, so that their largest entries are about 1."""
    exponents = rows.exponents[0]
    return np.ldexp(rows.A, exponents[:, None]), np.ldexp(rows.b, exponents)


def nearest_with_multipliers(
    rows: Rows, points: np.ndarray
) -> tuple[np.ndarray, np.ndarray] | None:
    """Return the nearest points ``(p, n)`` of inequalities that have a point, and multipliers.

    These ``(p, m)`` are at least 0, and with the rows add up to the ways from the nearest points,
    to rounding. None where one of the points was not found.
    """
    A, b = _scaled(rows)
    nearest, y, failed = project_points(A, b, 0, points)
    return None if failed >= 0 else (nearest, np.ldexp(np.maximum(y, 0.0), rows.exponents[0]))


def nearest_of_rows(rows: Rows, points: np.ndarray) -> Projection | int:
    """Return the nearest points of inequalities that have a point, or at which point it fails."""
    A, b = _scaled(rows)
    nearest, y, failed = project_points(A, b, 0, points)
    if failed >= 0:
        return failed
    ways = points - nearest
    distances = np.linalg.norm(ways, axis=1)
    slack = np.abs(y * (b - nearest @ A.T)).sum(axis=1)
    off = np.linalg.norm(ways - y @ A, axis=1)
    gaps = slack / np.where(distances > 0.0, distances, 1.0) + off
    return Projection(distances, nearest, np.minimum(gaps, distances))
