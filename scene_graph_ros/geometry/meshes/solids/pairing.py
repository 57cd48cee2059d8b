"""Which triangles belong together where more than two meet at an edge.

They are paired around it: those beside each other that bound one wedge of the solid. Where wedges
are nested, by the winding numbers of the sectors between triangles: the wedge that began last ends
first, so that no pair passes through another one.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.meshes.solids.half_edges import Edges, edges_of, mates_of
from scene_graph_ros.geometry.meshes.solids.walk import walk_parts
from scene_graph_ros.geometry.spatial.elementary import arc_tangents
from scene_graph_ros.geometry.spatial.sums import length, product

__all__ = ["is_nested_in_itself", "pair_around", "with_pairs_apart"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

_ONE_PLANE = 1e-6
"""Radians: triangles around an edge that are nearer to each other are in one plane."""

_NEARLY_ONE = 1e-4
"""Radians: the same of triangles so short that the rounding of their corners tells no more."""

_UP = (0.5403, 0.2918, 0.7892)
"""A direction that is along hardly any plane."""


def with_pairs_apart(vertices: FloatArray, triangles: IntArray) -> tuple[FloatArray, IntArray]:
    """Return oriented triangles (m, 3) with vertices of their own where only edges of two join.

    The same surface, in which no edge has more than two triangles and no vertex more than one fan,
    unless triangles go through each other at an edge.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    edges = edges_of(triangles)
    mate = mates_of(edges)
    if (mate < 0).any():
        label, turned, _ = walk_parts(mate, edges.start)
        is_closed = np.zeros(len(triangles), dtype=bool)
        pair_around(vertices, triangles, edges, mate, is_closed, label, turned)
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
    vertices: FloatArray,
    triangles: IntArray,
    edges: Edges,
    mate: IntArray,
    is_closed: BoolArray,
    label: IntArray,
    turned: BoolArray,
    gap: float = 0.0,
) -> bool:
    """Pair half edges of open parts around edges that have an even number of them; tell if any.

    ``label`` (m,) is the part of each triangle, as far as it is known by edges of two, and
    ``turned`` (m,) whether it runs the other way than the part's first one. What is nearer to
    another plane than ``gap``, metres, may be in it.
    """
    around = []
    for e in np.flatnonzero(edges.counts > 2):
        half = edges.order[edges.first[e] : edges.first[e + 1]]
        half = half[(mate[half] < 0) & ~is_closed[half // 3]]
        if len(half) > 1 and len(half) % 2 == 0:
            around.append(half)
    if not around:
        return False
    begins = (edges.start > edges.end) != np.repeat(_against(label, turned), 3)
    is_oriented = _run_alike(edges, around, begins)
    for half in around:
        if is_oriented[half[0] // 3]:
            half, _ = _around(vertices, triangles, edges, half, label, begins, gap)
            one, other = _wedges(begins[half])
        else:
            half = _without_own_pairs(half, begins[half], label, mate)
            if not len(half):
                continue
            half, gaps = _around(vertices, triangles, edges, half, label, None, gap)
            one = np.arange(_tighter(gaps), len(half), 2)
            other = (one + 1) % len(half)
        mate[half[one]], mate[half[other]] = half[other], half[one]
    return True


def _against(label: IntArray, turned: BoolArray) -> BoolArray:
    """Return a mask of triangles (m,): those that run against most of their part."""
    share = np.bincount(label, turned) / np.bincount(label)
    return turned != (share > 0.5)[label]


def _run_alike(edges: Edges, around: list[IntArray], begins: BoolArray) -> BoolArray:
    """Tell of triangles (m,) whether the bodies that they are joined with say what is inside.

    They do where each of the edges ``around`` is run through as often one way as the other.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    m, row = len(edges.order) // 3, edges.rows()
    triangle = np.arange(3 * m) // 3
    graph = coo_array((np.ones(3 * m), (triangle, m + row)), shape=(m + len(edges.counts),) * 2)
    body = connected_components(graph, directed=False)[1][:m]
    is_alike = np.ones(int(body.max()) + 1, dtype=bool)
    for half in around:
        is_alike[body[half[0] // 3]] &= 2 * np.count_nonzero(begins[half]) == len(half)
    return np.asarray(is_alike[body])


def _without_own_pairs(
    half: IntArray, begins: BoolArray, label: IntArray, mate: IntArray
) -> IntArray:
    """Pair those half edges (k,) that are the only two of their part; return the others."""
    of = label[half // 3]
    is_paired = np.zeros(len(half), dtype=bool)
    for part in np.unique(of):
        rows = np.flatnonzero(of == part)
        if len(rows) == 2 and begins[rows[0]] != begins[rows[1]]:
            one, other = half[rows]
            mate[one], mate[other] = other, one
            is_paired[rows] = True
    return half[~is_paired]


def is_nested_in_itself(vertices: FloatArray, triangles: IntArray) -> bool:
    """Tell whether oriented closed triangles (m, 3) wind twice around a sector at an edge."""
    edges = edges_of(triangles)
    label = np.zeros(len(triangles), dtype=np.int64)
    begins = edges.start > edges.end
    for e in np.flatnonzero(edges.counts > 2):
        half = edges.order[edges.first[e] : edges.first[e + 1]]
        half, _ = _around(vertices, triangles, edges, half, label, begins)
        if (begins[half] == np.roll(begins[half], 1)).any():
            return True
    return False


def _around(
    vertices: FloatArray,
    triangles: IntArray,
    edges: Edges,
    half: IntArray,
    label: IntArray,
    begins: BoolArray | None,
    gap: float = 0.0,
) -> tuple[IntArray, FloatArray]:
    """Return the half edges (k,) of an edge counter-clockwise around it, and the gaps behind them.

    Of those in one plane the solid's wedges end before others begin. Several that begin there, or
    end, are nested as their parts' labels say, the lowest outside, at all edges alike. ``begins``
    (3 m,) tells of half edges where wedges begin; without it, the labels' order is that of sheets
    on one another.
    """
    angles, arms, stack = _angles(vertices, triangles, edges, half)
    order = np.argsort(angles, kind="stable")
    gaps = np.diff(np.append(angles[order], angles[order[0]] + 2.0 * np.pi))
    # From the widest gap on, so that no plane is cut in two.
    widest = int(gaps.argmax()) + 1
    order, gaps = np.roll(order, -widest), np.roll(gaps, -widest)
    half, stack, arms = half[order], stack[order], arms[order]
    shorter = np.maximum(np.minimum(arms[:-1], arms[1:]), gap / _NEARLY_ONE)
    one_plane = np.maximum(_ONE_PLANE, gap / np.where(shorter > 0.0, shorter, 1.0))
    plane = np.concatenate([[0], np.cumsum(gaps[:-1] > one_plane)])
    ends_first = [] if begins is None else [begins[half]]
    way = stack if begins is None else np.where(begins[half], 1, -1)
    keys = [way * half, way * label[half // 3], *ends_first, plane]
    return half[np.lexsort(keys)], gaps


def _wedges(begins: BoolArray) -> tuple[IntArray, IntArray]:
    """Return the beginnings and ends of wedges, (k / 2,) rows each, of half edges (k,)."""
    sectors = np.cumsum(np.where(begins, 1, -1))
    first = int(sectors.argmin()) + 1  # behind a sector of the lowest winding number
    pairs, open_ones = [], []
    for k in range(first, first + len(begins)):
        row = k % len(begins)
        if begins[row]:
            open_ones.append(row)
        else:
            pairs.append((open_ones.pop(), row))
    one, other = np.array(pairs).T
    return one, other


def _angles(
    vertices: FloatArray, triangles: IntArray, edges: Edges, half: IntArray
) -> tuple[FloatArray, FloatArray, IntArray]:
    """Return the angles (k,) of triangles around their common edge, from the lower vertex.

    And how far (k,) their third corners are from it, and whether sheets on each are behind one
    another there in the order in which they are along _UP, 1, or the other way round, -1.
    """
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
    x, y = product(arms, u), product(arms, np.cross(axis, u))
    angles: FloatArray = arc_tangents(y, x)
    return (
        angles,
        np.sqrt(x * x + y * y),
        np.where(product(np.cross(axis, arms), np.array(_UP)) > 0.0, 1, -1),
    )


def _tighter(gaps: FloatArray) -> int:
    """Return 0 or 1: from which on pairs of half edges are nearer to each other.

    Pairs in one plane bound nothing: they are avoided.
    """
    is_flat = gaps <= _ONE_PLANE
    if is_flat[::2].any() != is_flat[1::2].any():
        return 1 if is_flat[::2].any() else 0
    return 0 if gaps[::2].sum() <= gaps[1::2].sum() else 1
