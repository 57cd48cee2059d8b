"""Collapse edges that are as short as the accuracy of unions."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.meshes.distinct_rows import distinct_rows

__all__ = ["without_short_edges"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_SHORT = 5e-11
"""Relative to the size: parts are pressed into each other by 1e-12, which moves the ends of edges
along faces that meet at a hundredth of a radian a hundred times as far."""


def without_short_edges(points: FloatArray, triangles: IntArray) -> IntArray:
    """Return triangles (m, 3) in which the ends of short edges are one vertex, and equal points.

    Needles have normals of rounding, and their ends have half of the normal cone each. Triangles
    that collapse are left out, and pairs that then lie on each other the opposite way round.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    distinct = distinct_rows(points)
    triangles = distinct.first[distinct.inverse][triangles]
    one, other = triangles.reshape(-1), np.roll(triangles, -1, axis=1).reshape(-1)
    size = float(np.ptp(points, axis=0).max(initial=0.0)) if len(points) else 0.0
    short = np.linalg.norm(points[one] - points[other], axis=1) <= _SHORT * size
    short &= one != other
    if short.any():
        n = len(points)
        graph = coo_array((np.ones(short.sum()), (one[short], other[short])), shape=(n, n))
        _, label = connected_components(graph, directed=False)
        first = np.full(int(label.max()) + 1, -1)
        first[label[::-1]] = np.arange(n)[::-1]
        triangles = first[label][triangles]
    a, b, c = triangles.T
    triangles = triangles[(a != b) & (b != c) & (c != a)]
    return _without_opposites(triangles) if short.any() else triangles


def _without_opposites(triangles: IntArray) -> IntArray:
    """Leave out pairs of triangles on the same vertices that run opposite ways."""
    distinct = distinct_rows(np.sort(triangles, axis=1))
    if len(distinct.first) == len(triangles):
        return triangles
    a, b, c = triangles.T
    runs_up = ((a < b) & (b < c)) | ((b < c) & (c < a)) | ((c < a) & (a < b))
    way = np.where(runs_up, 1, -1)
    surplus = np.bincount(distinct.inverse, way).astype(np.int64)[distinct.inverse]
    # The first so many of those that run the way of which there are more.
    order = np.lexsort([np.where(way * surplus > 0, 0, 1), distinct.inverse])
    starts = np.flatnonzero(np.diff(distinct.inverse[order], prepend=-1))
    sizes = np.diff(np.append(starts, len(order)))
    rank = np.empty(len(order), dtype=np.int64)
    rank[order] = np.arange(len(order)) - np.repeat(starts, sizes)
    return triangles[rank < np.abs(surplus)]
