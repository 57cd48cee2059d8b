"""Collapse edges that are as short as the accuracy of unions, but none of the parts' own."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.meshes.distinct_rows import distinct_rows

__all__ = ["SHORT", "Collapsed", "Corners", "with_near_ones_welded", "without_short_edges"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

SHORT = 5e-11
"""Relative to the size: parts are pressed into each other by 1e-12, which moves the ends of edges
along faces that meet at a hundredth of a radian a hundred times as far."""


NEAR = 1e-11
"""Relative to the size: vertices of bodies that touch are as near."""


class Corners(NamedTuple):
    """The corners of parts that were united."""

    at: FloatArray
    """(k, 3)."""
    part: IntArray
    """(k,)."""


class Collapsed(NamedTuple):
    """Triangles without short edges, and what they lost."""

    triangles: IntArray
    """(m, 3)."""
    lost: IntArray
    """(f,): a point of each feature that is lost: corners of one part that became one vertex."""
    size: float
    """Metres, the largest extent of such a feature along an axis."""


def without_short_edges(points: FloatArray, triangles: IntArray, corners: Corners) -> Collapsed:
    """Return triangles (m, 3) in which the ends of short edges are one vertex, and equal points.

    Needles have normals of rounding, and their ends have half of the normal cone each. Triangles
    that collapse are left out, and pairs that then lie on each other the opposite way round. An
    edge between corners of one part is no such needle, however short it is.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    distinct = distinct_rows(points)
    triangles = distinct.first[distinct.inverse][triangles]
    one, other = triangles.reshape(-1), np.roll(triangles, -1, axis=1).reshape(-1)
    size = float(np.ptp(points, axis=0).max(initial=0.0)) if len(points) else 0.0
    short = np.linalg.norm(points[one] - points[other], axis=1) <= SHORT * size
    short &= one != other
    lost, extent = one[:0], 0.0
    if short.any():
        one, other = one[short], other[short]
        of = _parts_of(points, np.union1d(one, other), corners)
        is_new = (of[one] != of[other]) | (of[one] < 0)
        n = len(points)
        ends = one[is_new], other[is_new]
        graph = coo_array((np.ones(len(ends[0])), ends), shape=(n, n))
        _, label = connected_components(graph, directed=False)
        lost, extent = _lost_features(points, label, of)
        first = np.full(int(label.max()) + 1, -1)
        first[label[::-1]] = np.arange(n)[::-1]
        triangles = first[label][triangles]
    a, b, c = triangles.T
    triangles = triangles[(a != b) & (b != c) & (c != a)]
    if short.any():
        triangles = _without_opposites(triangles)
    return Collapsed(triangles, lost, extent)


def with_near_ones_welded(points: FloatArray, triangles: IntArray, corners: Corners) -> IntArray:
    """Return triangles (m, 3) with one vertex for those that are as near as pressing leaves them.

    Where two bodies touch along an edge, a point nearest to it is as near to the edge of either:
    only the normals of all triangles there tell the side. Corners of one part stay apart.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    if not len(triangles):
        return triangles
    pairs = cKDTree(points).query_pairs(NEAR * float(np.ptp(points, axis=0).max()))
    one, other = np.array(sorted(pairs), dtype=np.int64).reshape(-1, 2).T
    if not len(one):
        return triangles
    of = _parts_of(points, np.union1d(one, other), corners)
    is_new = (of[one] != of[other]) | (of[one] < 0)
    n = len(points)
    ends = one[is_new], other[is_new]
    graph = coo_array((np.ones(len(ends[0])), ends), shape=(n, n))
    label = connected_components(graph, directed=False)[1]
    first = np.full(int(label.max()) + 1, -1)
    first[label[::-1]] = np.arange(n)[::-1]
    triangles = first[label][triangles]
    a, b, c = triangles.T
    return _without_opposites(triangles[(a != b) & (b != c) & (c != a)])


def _parts_of(points: FloatArray, rows: IntArray, corners: Corners) -> IntArray:
    """Return (v,): the part of which a point of rows (k,) is a corner, by coordinates, or -1."""
    near = np.flatnonzero(np.isin(corners.at[:, 0], points[rows, 0]))
    distinct = distinct_rows(np.concatenate([corners.at[near], points[rows]]))
    part = np.full(len(distinct.rows), -1)
    part[distinct.inverse[: len(near)]] = corners.part[near]
    result = np.full(len(points), -1)
    result[rows] = part[distinct.inverse[len(near) :]]
    return result


def _lost_features(points: FloatArray, label: IntArray, of: IntArray) -> tuple[IntArray, float]:
    """Return a point of each cluster (label) with two corners of one part, and their extent."""
    rows = np.flatnonzero(of >= 0)
    key = np.stack([label[rows], of[rows]], axis=1)
    distinct = distinct_rows(key)
    many = np.flatnonzero(np.bincount(distinct.inverse, minlength=len(distinct.first)) > 1)
    extents = [np.ptp(points[rows[distinct.inverse == k]], axis=0).max() for k in many]
    return rows[distinct.first[many]], float(max(extents, default=0.0))


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
