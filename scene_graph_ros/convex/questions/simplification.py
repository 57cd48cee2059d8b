"""A polyhedron inside another with fewer faces: faces move in until others are of no more use."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.convex.questions.arguments import (
    as_list,
    as_nonnegative,
    as_points,
    as_whole,
)

__all__ = ["Simplification", "simplified"]

_HALVINGS = 12
"""Of the way that a face moved in, when it is sought how far it may go back."""

_LABEL = "HPolyhedron.simplify_by_incremental_face_translation"


@dataclass(frozen=True)
class Simplification:
    """The constraints on the polyhedron inside, by the method's names."""

    min_volume_ratio: float = 0.1
    do_affine_transformation: bool = True
    max_iterations: Any = 10
    points_to_contain: Any = None
    intersecting_polytopes: Sequence[Any] = field(default_factory=tuple)
    keep_whole_intersection: bool = False
    intersection_padding: float = 1e-4
    random_seed: int = 0


def simplified(of: Any, asked: Simplification) -> Any:
    """Return the polyhedron, as `HPolyhedron.simplify_by_incremental_face_translation` says."""
    points, others = _checked(of, asked)
    n, kind = of.ambient_dimension, type(of)
    start = of.reduce_inequalities(0.0)
    center = start.chebyshev_center()
    # What is this much smaller stays inside whatever moves, and with it so much of the volume.
    ratio = asked.min_volume_ratio ** (1.0 / n)
    least = start.A @ center + ratio * (start.b - start.A @ center)
    if len(points):
        least = np.maximum(least, (points @ start.A.T).max(axis=0))
    A, b, names = start.A, start.b.copy(), np.arange(len(start.b))
    generator = np.random.default_rng(asked.random_seed)
    for _ in range(asked.max_iterations):
        count = len(names)
        for i in generator.permutation(names):
            if i not in names:
                continue
            side = _furthest_in(kind(A[names], b[names]), A[i], b[i], least[i], others, asked)
            names = _without_redundant(kind, A, b, names, int(i), side)
        if len(names) == count:
            break
    inside = kind(A[names], b[names])
    if not asked.do_affine_transformation:
        return inside
    larger = inside.maximum_volume_inscribed_affine_transformation(of)
    keeps = not len(points) or bool((points @ larger.A.T <= larger.b).all())
    return larger if keeps and all(larger.intersects_with(q) for q in others) else inside


def _checked(of: Any, asked: Simplification) -> tuple[np.ndarray, tuple[Any, ...]]:
    """Return points and polytopes that the result has to keep. Raises ConvexSetError."""
    n = of.ambient_dimension
    ratio = as_nonnegative(asked.min_volume_ratio, f"{_LABEL}: min_volume_ratio")
    if not 0.0 < ratio <= 1.0:
        raise ConvexSetError(f"{_LABEL}: min_volume_ratio must be above 0, up to 1, not {ratio!r}")
    as_whole(asked.max_iterations, f"{_LABEL}: max_iterations", 1)
    as_whole(asked.random_seed, f"{_LABEL}: random_seed")
    as_nonnegative(asked.intersection_padding, f"{_LABEL}: intersection_padding")
    if n == 0 or of.is_empty() or not of.is_bounded():
        raise ConvexSetError(f"{_LABEL}: the set must be bounded and have a point, in dimensions")
    given = np.zeros((0, n)) if asked.points_to_contain is None else asked.points_to_contain
    points, _ = as_points(given, f"{_LABEL}: points_to_contain", n)
    outside = np.flatnonzero((points @ of.A.T > of.b).any(axis=1))
    if len(outside):
        raise ConvexSetError(
            f"{_LABEL}: points_to_contain must be in the set, which {points[outside[0]].tolist()}"
            " is not"
        )
    others = tuple(as_list(asked.intersecting_polytopes, f"{_LABEL}: intersecting_polytopes"))
    for k, other in enumerate(others):
        question = f"simplify_by_incremental_face_translation: intersecting_polytopes[{k}]"
        of._check_other(other, question, type(of))
        if not of.intersects_with(other):
            raise ConvexSetError(
                f"{_LABEL}: intersecting_polytopes[{k}] does not meet the set; leave it out"
            )
    return points, others


def _furthest_in(
    body: Any, row: np.ndarray, side: float, least: float, others: Any, asked: Simplification
) -> float:
    """Return the least side that a row of a body may have."""
    length = float(np.linalg.norm(row))
    for other in others:
        shared = body.intersection(other)
        if asked.keep_whole_intersection:
            reached = shared.support(row)
            least = max(least, reached.value + reached.gap)
        else:
            reached = shared.support(-row)
            nearest = -reached.value + reached.gap
            least = max(least, nearest + asked.intersection_padding * length)
    return min(side, least)


def _without_redundant(
    kind: Any, A: np.ndarray, b: np.ndarray, names: np.ndarray, i: int, side: float
) -> np.ndarray:
    """Move a row in if others then follow, back as far as they do; return rows that stay."""
    before, others = b[i], names[names != i]

    def follow(at: float) -> bool:
        """Tell whether the rows that go follow from those that stay, with the row moved."""
        b[i] = at
        kept = np.setdiff1d(names, gone)
        return bool(kind(A[kept], b[kept]).contained_in(kind(A[gone], b[gone]), 0.0))

    b[i] = side
    gone = np.array(
        sorted(others[k] for k in _redundant(kind(A[others], b[others]), A[i], side)), dtype=int
    )
    if not len(gone):
        b[i] = before
        return names
    low, high = side, before
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if follow(middle):
            low = middle
        else:
            high = middle
    b[i] = low
    return np.setdiff1d(names, gone)


def _redundant(others: Any, row: np.ndarray, side: float) -> list[int]:
    """Return the indices of rows implied by a polyhedron's others and one more, which stays."""
    kind, left = type(others), list(range(len(others.b)))
    gone: list[int] = []
    for k in list(left):
        rest = [j for j in left if j != k]
        body = kind(np.vstack([others.A[rest], row]), np.append(others.b[rest], side))
        if body.contained_in(kind(others.A[[k]], others.b[[k]]), 0.0):
            left, gone = rest, [*gone, k]
    return gone
