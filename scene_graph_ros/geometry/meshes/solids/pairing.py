"""Which triangles belong together where more than two meet at an edge.

They are paired around it: those beside each other that bound one wedge of the solid.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.meshes.solids.half_edges import Edges, edges_of, mates_of
from scene_graph_ros.geometry.spatial.elementary import arc_tangents
from scene_graph_ros.geometry.spatial.sums import length, product

__all__ = ["pair_around", "with_pairs_apart"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]


def with_pairs_apart(vertices: FloatArray, triangles: IntArray) -> tuple[FloatArray, IntArray]:
    """Return oriented triangles (m, 3) with vertices of their own where only edges of two join.

    The same surface, in which no edge has more than two triangles and no vertex more than one fan,
    unless triangles go through each other at an edge.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    edges = edges_of(triangles)
    mate = mates_of(edges)
    if not (edges.counts == 2).all():
        pair_around(vertices, triangles, edges, mate, np.zeros(len(triangles), dtype=bool))
    half = np.flatnonzero(mate >= 0)
    across = mate[half]
    # Corner h is where half edge h begins, and its mate ends there.
    ends = 3 * (across // 3) + (across % 3 + 1) % 3
    n = len(mate)
    graph = coo_array((np.ones(len(half)), (half, ends)), shape=(n, n))
    _, label = connected_components(graph, directed=False)
    first = np.unique(label, return_index=True)[1]
    return vertices[edges.start[first]], label.astype(np.int64).reshape(-1, 3)


def pair_around(
    vertices: FloatArray, triangles: IntArray, edges: Edges, mate: IntArray, is_closed: BoolArray
) -> bool:
    """Pair half edges of open parts around edges that have an even number of them; tell if any."""
    counts = edges.counts
    changed = False
    for e in np.flatnonzero(counts > 2):
        half = edges.order[edges.first[e] : edges.first[e + 1]]
        half = half[(mate[half] < 0) & ~is_closed[half // 3]]
        if len(half) < 2 or len(half) % 2:
            continue
        angles = _angles(vertices, triangles, edges, half)
        order = np.lexsort([_layers(triangles, edges, half), angles])
        half, angles = half[order], angles[order]
        low = edges.start[half] < edges.end[half]
        if (low[::2] != low[1::2]).all():
            # Counter-clockwise around the edge, a half edge along it is where its solid ends.
            shift = 0 if not low[0] else 1
        else:
            shift = _tighter(angles, np.sort(triangles[half // 3], axis=1))
        half = np.roll(half, -shift)
        mate[half[::2]], mate[half[1::2]] = half[1::2], half[::2]
        changed = True
    return changed


def _layers(triangles: IntArray, edges: Edges, half: IntArray) -> IntArray:
    """Return numbers that order doubled triangles around their edge as sheets on one another.

    The sheets are stacked along the normal of the triangle with its vertices in ascending order.
    """
    corner = triangles[half // 3, (half % 3 + 2) % 3]
    low, high = np.minimum(edges.start[half], edges.end[half]), edges.end[half]
    high = np.maximum(edges.start[half], high)
    is_middle = (corner > low) & (corner < high)
    return np.where(is_middle, -1, 1) * half


def _angles(vertices: FloatArray, triangles: IntArray, edges: Edges, half: IntArray) -> FloatArray:
    """Return the angles (k,) of triangles around their common edge, from the lower vertex."""
    low = np.minimum(edges.start[half[0]], edges.end[half[0]])
    high = np.maximum(edges.start[half[0]], edges.end[half[0]])
    axis = vertices[high] - vertices[low]
    if not axis.any():
        axis = np.ones(3)  # of equal vertices any direction is as good
    axis /= length(axis)
    across = np.eye(3)[np.abs(axis).argmin()]
    u = np.cross(axis, across)
    u /= length(u)
    corner = triangles[half // 3, (half % 3 + 2) % 3]
    arms = vertices[corner] - vertices[low]
    angles: FloatArray = arc_tangents(product(arms, np.cross(axis, u)), product(arms, u))
    return angles


def _tighter(angles: FloatArray, corners: IntArray) -> int:
    """Return 0 or 1: from which on pairs of sorted angles are nearer to each other.

    Pairs of doubled triangles, with equal ``corners`` (k, 3), bound nothing: they are avoided.
    """
    doubled = (corners == np.roll(corners, -1, axis=0)).all(axis=1)
    if doubled[::2].any() != doubled[1::2].any():
        return 1 if doubled[::2].any() else 0
    gaps = np.diff(np.append(angles, angles[0] + 2.0 * np.pi))
    return 0 if gaps[::2].sum() <= gaps[1::2].sum() else 1
