"""Which edges of a mesh pass through which of its triangles, by signs that are exact.

Signs of volumes are taken from floating point where that is certain, else from whole numbers.
They can't contradict each other, so the curves along which triangles cross have no loose ends.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.kernel import kernel, lean_kernel
from scene_graph_ros.geometry.meshes.bvh import build_bvh, traversal_stack
from scene_graph_ros.geometry.meshes.solids.overlaps import next_leaf
from scene_graph_ros.geometry.meshes.triangle_boxes import triangle_boxes
from scene_graph_ros.geometry.spatial.vectors import cross, dot, load_vector, norm, subtract

__all__ = ["DegenerateError", "Piercings", "TooManyError", "piercings"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_CERTAIN = 1e-14
"""Relative to the sum of a determinant's absolute products: a larger one has a certain sign."""

_CERTAIN_HEIGHT = 1e-13
"""The same of heights above a plane, relative to the largest coordinate."""


_MOST_PAIRS = 500_000
"""Pairs of triangles that are asked whether they cross; as many take some 0.9 GB."""


class TooManyError(Exception):
    """Triangles cross so often that cutting them would take minutes, or gigabytes."""


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


@lean_kernel
def _meets(lower, upper, i, other_lower, other_upper, j):
    """Return whether two boxes meet."""
    for axis in range(3):
        if lower[i, axis] > other_upper[j, axis] or upper[i, axis] < other_lower[j, axis]:
            return False
    return True


@lean_kernel
def _is_above_or_below(vertices, triangles, t, s, origin, n, slack):
    """Tell whether all corners of s that t has not are above or below the plane of t for sure."""
    lowest, highest = np.inf, -np.inf
    for k in range(3):
        v = triangles[s, k]
        if v == triangles[t, 0] or v == triangles[t, 1] or v == triangles[t, 2]:
            continue
        height = dot(n, subtract(load_vector(vertices, v), origin))
        lowest, highest = min(lowest, height), max(highest, height)
    return lowest > slack or highest < -slack


@lean_kernel
def _is_beside(vertices, triangles, t, s, most):
    """Tell whether s is on one side of the plane of t, where floating point is certain of it.

    ``most`` is the largest coordinate.
    """
    a = load_vector(vertices, triangles[t, 0])
    ab = subtract(load_vector(vertices, triangles[t, 1]), a)
    ac = subtract(load_vector(vertices, triangles[t, 2]), a)
    # A needle's normal is as uncertain as the product of its sides is larger than its area.
    slack = _CERTAIN_HEIGHT * most * norm(ab) * norm(ac)
    return _is_above_or_below(vertices, triangles, t, s, a, cross(ab, ac), slack)


@kernel
def _candidates(vertices, triangles, lower, upper, tree, most, limit):
    """Return pairs (k, 2) of triangles that share at most one vertex, and may cross.

    Those are limit pairs where there are as many or more.
    """
    order = tree[4]
    stack = traversal_stack()
    pairs, count = np.empty((64, 2), np.int64), 0
    for t in range(len(triangles)):
        stack[0] = 0
        slot, end, depth = next_leaf(stack, 1, lower, upper, t, tree)
        while slot < end:
            for k in range(slot, end):
                s = order[k]
                if s <= t or not _meets(lower, upper, t, lower, upper, s):
                    continue
                shared = 0
                for i in range(3):
                    for j in range(3):
                        shared += triangles[t, i] == triangles[s, j]
                if (
                    shared > 1
                    or _is_beside(vertices, triangles, t, s, most)
                    or _is_beside(vertices, triangles, s, t, most)
                ):
                    continue
                if count == len(pairs):
                    longer = np.empty((2 * count, 2), np.int64)
                    longer[:count] = pairs
                    pairs = longer
                pairs[count, 0], pairs[count, 1] = t, s
                count += 1
                if count == limit:
                    return pairs[:count].copy()
            slot, end, depth = next_leaf(stack, depth, lower, upper, t, tree)
    return pairs[:count].copy()


def piercings(vertices: FloatArray, triangles: IntArray) -> Piercings:
    """Return the pairs of edges and triangles that they pass through.

    Args:
        vertices: (v, 3) whole numbers, in general position.
        triangles: (m, 3).

    Raises:
        DegenerateError: the position is not general: four points of two triangles are in a plane.
        TooManyError: more pairs of triangles may cross than are asked.

    """
    lower, upper = triangle_boxes(vertices, triangles)
    tree: tuple[Any, ...] = build_bvh(lower, upper)
    arrays = (np.array(a, order="C") for a in (vertices, triangles, lower, upper))
    most = float(np.abs(vertices[triangles]).max(initial=0.0))
    pairs = _candidates(*arrays, tree, most, _MOST_PAIRS)
    if len(pairs) == _MOST_PAIRS:
        raise TooManyError(f"more than {_MOST_PAIRS} pairs of triangles may cross")
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
