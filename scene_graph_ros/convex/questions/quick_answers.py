"""Proofs in floats of sets with flat faces, for questions without a certificate.

The kernels bound rounding; where that leaves a question open, the answer here is None,
and fractions decide.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from scene_graph_ros.convex.errors import SolverError
from scene_graph_ros.convex.questions.answers import Support
from scene_graph_ros.convex.questions.arguments import frozen
from scene_graph_ros.convex.questions.row_geometry import later_twins
from scene_graph_ros.convex.questions.touching import APART, NEAR
from scene_graph_ros.convex.solve.floats.quick_bounds import is_bounded_quickly
from scene_graph_ros.convex.solve.floats.quick_points import (
    center_quickly,
    EMPTY,
    OPEN,
    point_quickly,
)
from scene_graph_ros.convex.solve.floats.quick_reduction import reduce_quickly
from scene_graph_ros.convex.solve.floats.quick_rows import (
    follow_quickly,
    INSIDE,
    OUTSIDE,
)
from scene_graph_ros.convex.solve.floats.quick_supports import (
    extents_quickly,
    support_quickly,
)
from scene_graph_ros.convex.solve.nearest.nearest_by_support import nearest_by_support
from scene_graph_ros.geometry.spatial.sums import product

__all__ = [
    "center_of_rows",
    "extents_of_rows",
    "is_contained",
    "is_row_bounded",
    "meet",
    "point_of_rows",
    "reached",
    "redundant",
    "rows_that_follow",
    "support_of_rows",
]


def point_of_rows(A: np.ndarray, b: np.ndarray) -> tuple[bool | None, np.ndarray]:
    """Tell whether ``A x <= b`` has no point, None where that is left open.

    And return a point ``(n,)`` of it in floats, where it has one.
    """
    x = np.empty(A.shape[1])
    status = point_quickly(A, b, x)
    return None if status == OPEN else bool(status == EMPTY), x


def center_of_rows(A: np.ndarray, b: np.ndarray) -> np.ndarray | None:
    """Return the centre ``(n,)`` of the largest ball in ``A x <= b``, None where left open."""
    x = np.empty(A.shape[1])
    return x if center_quickly(A, b, x) else None


def extents_of_rows(A: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """Return corners ``(n,)`` of a box that ``A x <= b`` is in, None where that is left open."""
    low, high = np.empty(A.shape[1]), np.empty(A.shape[1])
    return (low, high) if extents_quickly(A, b, low, high) else None


def support_of_rows(
    A: np.ndarray, b: np.ndarray, start: np.ndarray, d: np.ndarray
) -> Support | None:
    """Return the support of ``A x <= b`` from a point of it, None where that is left open."""
    x = np.empty(len(d))
    gap = support_quickly(A, b, start, d, x)
    return None if gap < 0.0 else Support(float(product(d, x)), x, gap)


def is_row_bounded(A: np.ndarray) -> bool | None:
    """Tell whether ``A x <= b`` is bounded, None where that is left open."""
    return True if is_bounded_quickly(A) else None


def meet(one: Any, other: Any) -> bool | None:
    """Tell whether two sets have a point in common, None where that is left open."""
    left, right = one._linear_rows(), other._linear_rows()
    if left is None or right is None:
        return None
    A, b = np.concatenate([left[0], right[0]]), np.concatenate([left[1], right[1]])
    A.setflags(write=False)
    b.setflags(write=False)
    empty, _ = point_of_rows(A, b)
    if empty is None and one.own_box is not None and other.own_box is not None:
        lows, highs = zip(one.own_box, other.own_box, strict=True)
        empty = bool((np.maximum(*lows) > np.minimum(*highs)).any())
    return None if empty is None else not empty


class Reached(NamedTuple):
    """What floats know of two bounded sets by how far both reach along some directions."""

    is_apart: bool
    """Whether a plane between them is shown to be one."""
    is_near: bool
    """Whether points of them are within 1e-11 of their coordinates."""
    points: tuple[np.ndarray, np.ndarray]
    """``(k, n)`` of each: those that were furthest in some direction."""


def reached(one: Any, other: Any) -> Reached:
    """Tell whether bounded sets that aren't empty are shown to be apart by a plane between them.

    It is sought as the nearest point to 0 of the differences of their points; how far both reach
    along it decides, with room for rounding.
    """
    n, seen = one.ambient_dimension, []

    def reach(direction: np.ndarray) -> tuple[float, np.ndarray, float]:
        first, second = one.support(direction), other.support(-direction)
        seen.append((first.point, second.point))
        gap = first.gap + second.gap
        return first.value + second.value, first.point - second.point, gap

    is_apart = is_near = False
    try:
        distance, nearest, _ = nearest_by_support(reach, np.zeros(n), 4.0 * APART * n)
        if distance > 0.0:
            value, _, gap = reach(-nearest / distance)
            is_apart = value + gap < -APART * n * float(np.abs(seen).max())
        is_near = distance <= NEAR * float(np.abs(seen).max())
    except SolverError:  # not known as well as promised how far a curved set reaches
        pass
    firsts, seconds = (np.unique(points, axis=0) for points in zip(*seen, strict=True))
    return Reached(is_apart, is_near and not is_apart, (firsts, seconds))


def is_contained(asked: Any, other: Any, tol: float) -> bool | None:
    """Tell whether a set is in a polyhedron moved out by a distance, None where left open."""
    found = _follow(asked, other, tol, True)
    if found is None:
        return None
    if (found == OUTSIDE).any():
        return False
    return True if (found == INSIDE).all() else None


def rows_that_follow(asked: Any, other: Any, tol: float) -> np.ndarray:
    """Return for each row of a polyhedron whether it holds on a set: 1, -1, 0 if left open."""
    found = _follow(asked, other, tol, False)
    return np.zeros(len(other.b), dtype=np.int64) if found is None else found


def _follow(asked: Any, other: Any, tol: float, ends_outside: bool) -> np.ndarray | None:
    rows = asked._linear_rows()
    if rows is None:
        return None
    found = np.empty(len(other.b), dtype=np.int64)
    follow_quickly(*rows, other.A, other.b, tol, ends_outside, found)
    return found


def redundant(A: np.ndarray, b: np.ndarray, tol: float) -> np.ndarray | None:
    """Return a mask ``(m,)`` of redundant rows, None where that is left open."""
    twins = later_twins(A, b) if tol >= 0.0 else {}
    alone = np.delete(np.arange(len(b)), list(twins))
    is_kept = np.zeros(len(alone), dtype=np.bool_)
    if not reduce_quickly(frozen(A[alone]), frozen(b[alone]), tol, is_kept):
        return None
    left_out = np.ones(len(b), dtype=np.bool_)
    left_out[alone] = ~is_kept
    return left_out
