"""How often a surface winds around the points just above each of its polygons.

Across an edge of two polygons the number stays; where two triangles cross, it changes from the
front of the other triangle to its back by as many as that one stands for. So numbers are known up
to one constant for each connected surface, and that is counted at its largest polygons, which have
clear answers.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.meshes.solids.piercing import DegenerateError
from scene_graph_ros.geometry.meshes.solids.winding import winding_numbers

__all__ = ["Rings", "area_vectors", "numbers_above", "rings_of"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_VOTERS = 32
"""Polygons of a connected surface at which its number is counted."""


class Rings(NamedTuple):
    """The sides of polygons, those of one polygon behind each other."""

    start: IntArray
    """(s,): the point where each side begins."""
    end: IntArray
    """(s,)."""
    polygon: IntArray
    """(s,): ascending from 0."""
    source: IntArray
    """(n,): the triangle that each polygon is of."""


def rings_of(polygons: list[list[int]], triangles: IntArray, source: IntArray) -> Rings:
    """Return the sides of polygons, and of triangles (k, 3) behind them; ``source`` is of all."""
    count = len(polygons)
    sizes = np.array([*map(len, polygons), *[3] * len(triangles)], dtype=np.int64)
    flat = np.array([p for ring in polygons for p in ring], dtype=np.int64)
    start = np.concatenate([flat, triangles.reshape(-1)])
    first = np.concatenate([[0], np.cumsum(sizes)[:-1]]).astype(np.int64)
    following = np.arange(1, len(start) + 1)
    following[np.cumsum(sizes) - 1] = first
    polygon = np.repeat(np.arange(count + len(triangles)), sizes)
    return Rings(start, start[following], polygon, source)


def numbers_above(
    points: FloatArray,
    rings: Rings,
    is_front: list[dict[int, bool]],
    vertices: FloatArray,
    triangles: IntArray,
    times: IntArray,
) -> IntArray:
    """Return (n,) winding numbers on the front sides of the polygons of closed triangles.

    ``is_front`` tells of polygons, the first ones, on which side of other triangles they are, and
    ``times`` (m,) how many triangles each stands for. Raises DegenerateError where the polygons do
    not fit together.
    """
    middles, vectors = area_vectors(points, rings)
    areas = np.linalg.norm(vectors, axis=1)
    one, other, change = _relations(len(points), rings, is_front, times)
    label, relative = _along(one, other, change, len(middles))
    order = np.lexsort([-areas, label])
    rank = np.arange(len(order)) - np.searchsorted(label[order], label[order])
    asked = order[rank < _VOTERS]
    counted = winding_numbers(middles[asked], vertices, triangles, rings.source[asked], times)
    offset = counted - relative[asked]
    # Per surface, the number that most of the area says.
    lowest = int(offset.min())
    votes = np.zeros((int(label.max()) + 1, int(offset.max()) - lowest + 1))
    np.add.at(votes, (label[asked], offset - lowest), areas[asked] + np.finfo(np.float64).tiny)
    return np.asarray(relative + votes.argmax(axis=1)[label] + lowest)


def area_vectors(points: FloatArray, rings: Rings) -> tuple[FloatArray, FloatArray]:
    """Return the middles (n, 3) of polygons' corners, and normals (n, 3) as long as areas."""
    count = len(rings.source)
    sizes = np.bincount(rings.polygon, minlength=count)
    sums = [np.bincount(rings.polygon, points[rings.start, k], count) for k in range(3)]
    middles = np.stack(sums, axis=1) / sizes[:, None]
    arms = points[rings.start] - middles[rings.polygon]
    sides = np.cross(arms, points[rings.end] - middles[rings.polygon])
    vectors = [np.bincount(rings.polygon, sides[:, k], count) for k in range(3)]
    return middles, np.asarray(0.5 * np.stack(vectors, axis=1), dtype=np.float64)


def _relations(
    count: int, rings: Rings, is_front: list[dict[int, bool]], times: IntArray
) -> tuple[IntArray, IntArray, IntArray]:
    """Return polygons (k,), their neighbours, and by how much the neighbours' numbers differ."""
    key = np.minimum(rings.start, rings.end) * count + np.maximum(rings.start, rings.end)
    order = np.argsort(key, kind="stable")
    first = np.flatnonzero(np.diff(key[order], prepend=-1))
    counts = np.diff(np.append(first, len(order)))
    two = first[counts == 2]
    a, b = order[two], order[two + 1]
    if (rings.start[a] == rings.start[b]).any():
        raise DegenerateError
    four = order[first[counts == 4][:, None] + np.arange(4)]
    polygon = rings.polygon[four]
    by_source = np.argsort(rings.source[polygon], axis=1, kind="stable")
    polygon = np.take_along_axis(polygon, by_source, axis=1)
    source = rings.source[polygon]
    is_crossing = (source[:, 0] == source[:, 1]) & (source[:, 2] == source[:, 3])
    is_crossing &= source[:, 1] != source[:, 2]
    polygon, source = polygon[is_crossing], source[is_crossing]
    pairs = np.concatenate([polygon[:, :2], polygon[:, 2:]])
    across = np.concatenate([source[:, 2], source[:, 0]])
    ways = [
        np.array(
            [is_front[p][t] for p, t in zip(pairs[:, k].tolist(), across.tolist(), strict=True)]
        )
        for k in (0, 1)
    ]
    if (ways[0] == ways[1]).any():
        raise DegenerateError
    return (
        np.concatenate([rings.polygon[a], pairs[:, 0]]),
        np.concatenate([rings.polygon[b], pairs[:, 1]]),
        np.concatenate(
            [
                np.zeros(len(a), dtype=np.int64),
                np.where(ways[0].astype(bool), 1, -1) * times[across],
            ]
        ),
    )


def _along(
    one: IntArray, other: IntArray, change: IntArray, count: int
) -> tuple[IntArray, IntArray]:
    """Return for (count,) polygons a surface each, and numbers relative to its first polygon's.

    Raises DegenerateError where two ways to a polygon give different numbers.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import breadth_first_order, connected_components

    graph = coo_array((np.ones(len(one)), (one, other)), shape=(count, count)).tocsr()
    _, label = connected_components(graph, directed=False)
    # One root above all surfaces' first polygons, so that one search reaches everything.
    firsts = np.unique(label, return_index=True)[1]
    root = np.full(len(firsts), count)
    one, other = np.concatenate([one, root]), np.concatenate([other, firsts])
    change = np.concatenate([change, np.zeros(len(firsts), dtype=np.int64)])
    shape = (count + 1, count + 1)
    graph = coo_array((np.ones(len(one)), (one, other)), shape=shape).tocsr()
    order, before = breadth_first_order(graph, count, directed=False)
    ways = {
        **dict(
            zip(zip(other.tolist(), one.tolist(), strict=True), (-change).tolist(), strict=True)
        ),
        **dict(zip(zip(one.tolist(), other.tolist(), strict=True), change.tolist(), strict=True)),
    }
    numbers = [0] * (count + 1)
    for at in order[1:].tolist():
        of = int(before[at])
        numbers[at] = numbers[of] + ways[of, at]
    relative = np.array(numbers, dtype=np.int64)
    if (relative[other] - relative[one] != change).any():
        raise DegenerateError
    return np.asarray(label, dtype=np.int64), relative[:count]
