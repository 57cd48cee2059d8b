"""Which edges of a mesh pass through which of its triangles, by signs that are exact.

Signs of volumes are taken from floating point where that is certain, else from whole numbers.
They can't contradict each other, so the curves along which triangles cross have no loose ends.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.meshes.bvh import build_bvh
from scene_graph_ros.geometry.meshes.solids.overlaps import meeting_boxes

__all__ = ["DegenerateError", "Piercings", "piercings"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_CERTAIN = 1e-14
"""Relative to the sum of a determinant's absolute products: a larger one has a certain sign."""


class DegenerateError(Exception):
    """Triangles touch each other without crossing, or are in one plane."""


class Piercings(NamedTuple):
    """Edges that pass through triangles; one row each."""

    edge: IntArray
    """(k, 2): the vertices of the edge, ascending."""
    through: IntArray
    """(k,): the triangle that it passes through."""
    owner: IntArray
    """(k,): a triangle with that edge; an edge has a row for each."""


def _exact_sign(corners: FloatArray) -> int:
    rows = [[int(x) for x in corner] for corner in corners]
    a, b, c = ([x - y for x, y in zip(row, rows[3], strict=True)] for row in rows[:3])
    value = (
        a[0] * (b[1] * c[2] - b[2] * c[1])
        - a[1] * (b[0] * c[2] - b[2] * c[0])
        + a[2] * (b[0] * c[1] - b[1] * c[0])
    )
    return (value > 0) - (value < 0)


def _signs(vertices: FloatArray, four: IntArray) -> IntArray:
    """Return (k,) signs of the volumes of (k, 4) tetrahedra. Raises DegenerateError at 0."""
    corners = vertices[four]
    a, b, c = (corners[:, k] - corners[:, 3] for k in range(3))
    value = np.einsum("ij,ij->i", a, np.cross(b, c))
    p, q, r = np.abs(a), np.abs(b), np.abs(c)
    most = p[:, 0] * (q[:, 1] * r[:, 2] + q[:, 2] * r[:, 1])
    most += p[:, 1] * (q[:, 0] * r[:, 2] + q[:, 2] * r[:, 0])
    most += p[:, 2] * (q[:, 0] * r[:, 1] + q[:, 1] * r[:, 0])
    result = np.sign(value).astype(np.int64)
    for row in np.flatnonzero(np.abs(value) <= _CERTAIN * most):
        result[row] = _exact_sign(corners[row])
        if result[row] == 0:
            raise DegenerateError
    return result


def _candidates(vertices: FloatArray, triangles: IntArray) -> tuple[IntArray, FloatArray]:
    """Return pairs (k, 2) of triangles whose boxes meet, that share at most one vertex."""
    corners = vertices[triangles]
    lower, upper = corners.min(axis=1), corners.max(axis=1)
    tree: tuple[Any, ...] = build_bvh(lower, upper)
    pairs = meeting_boxes(lower, upper, tree)
    pairs = pairs[pairs[:, 0] < pairs[:, 1]]
    one, other = triangles[pairs[:, 0]], triangles[pairs[:, 1]]
    shared = (one[:, :, None] == other[:, None, :]).any(axis=2)
    few = shared.sum(axis=1) < 2
    return pairs[few], shared[few]


def piercings(vertices: FloatArray, triangles: IntArray) -> Piercings:
    """Return which edges pass through which triangles.

    Args:
        vertices: (v, 3) whole numbers, in general position.
        triangles: (m, 3).

    Raises:
        DegenerateError: the position is not general: four points of two triangles are in a plane.

    """
    pairs, _ = _candidates(vertices, triangles)
    both = np.concatenate([pairs, pairs[:, ::-1]])
    owner, through = both[:, 0], both[:, 1]
    # On which side of the other's plane each corner is, and 0 for a corner of the other.
    corners, plane = triangles[owner], triangles[through]
    is_shared = (corners[:, :, None] == plane[:, None, :]).any(axis=2)
    row, k = np.nonzero(~is_shared)
    side = np.zeros(corners.shape, dtype=np.int64)
    side[row, k] = _signs(vertices, np.column_stack([plane[row], corners[row, k]]))
    n = len(pairs)
    crosses = (side.min(axis=1) < 0) & (side.max(axis=1) > 0)
    # A triangle that has a corner in common needs only to reach across on one of both sides.
    touches = is_shared.any(axis=1)
    apart = ~(crosses | touches)
    apart = apart[:n] | apart[n:]
    rows = np.flatnonzero(~np.concatenate([apart, apart]))
    owner, through, side = owner[rows], through[rows], side[rows]
    row, k = np.nonzero(side * np.roll(side, -1, axis=1) < 0)
    start, end = triangles[owner[row], k], triangles[owner[row], (k + 1) % 3]
    edge = np.stack([np.minimum(start, end), np.maximum(start, end)], axis=1)
    owner, through = owner[row], through[row]
    around = [
        _signs(vertices, np.column_stack([edge, triangles[through, i], triangles[through, j]]))
        for i, j in ((0, 1), (1, 2), (2, 0))
    ]
    inside = (around[0] == around[1]) & (around[1] == around[2])
    return Piercings(edge[inside], through[inside], owner[inside])
