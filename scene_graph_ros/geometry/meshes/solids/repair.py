"""Close nearly closed surfaces: doubled triangles, seams, T vertices, strays.

In this order, and only where an edge is open: vertices on open edges that are within a tolerance
of each other are welded; an edge with such a vertex beside it is split there; of triangles on the
same three vertices as many are kept as close the edges around them; open parts without an area
are dropped.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.meshes.distinct_rows import distinct_rows
from scene_graph_ros.geometry.meshes.solids.half_edges import (
    edges_of,
    mates_of,
    open_half_edges,
)
from scene_graph_ros.geometry.meshes.solids.mesh_report import Repair
from scene_graph_ros.geometry.meshes.solids.walk import walk_parts
from scene_graph_ros.geometry.spatial.sums import product
from scene_graph_ros.geometry.tolerances import DEGENERATE_TRIANGLE

__all__ = ["repaired", "without_doubles"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_PASSES = 24
"""An edge of each triangle is split in each; a triangle with many T vertices takes more."""


def repaired(
    vertices: FloatArray, triangles: IntArray, tolerance: float, *, layers: int
) -> tuple[IntArray, list[Repair]]:
    """Return the triangles (m, 3) over the same vertices, and the repairs.

    Args:
        vertices: (v, 3), no two equal.
        triangles: (m, 3), each of three vertices.
        tolerance: metres; how large a gap may be.
        layers: 2 or 0, how many of triangles on the same vertices are kept where an even number
            closes the edges around: 2 are faces of bodies that touch or are nested.

    """
    repairs: list[Repair] = []
    triangles = without_doubles(vertices, triangles, repairs, layers)
    triangles = _without_strays(vertices, triangles, repairs)
    if len(triangles) and (edges_of(triangles).counts % 2).any():
        triangles = _without_seams(vertices, triangles, tolerance, repairs)
        triangles = _without_t_vertices(vertices, triangles, tolerance, repairs)
        triangles = without_doubles(vertices, triangles, repairs, layers)
        triangles = _without_strays(vertices, triangles, repairs)
    return triangles, repairs


def _note(repairs: list[Repair], kind: str, count: int, point: FloatArray) -> None:
    x, y, z = (float(c) for c in point)
    repairs.append(Repair(kind, count, (x, y, z)))


def without_doubles(
    vertices: FloatArray, triangles: IntArray, repairs: list[Repair], layers: int
) -> IntArray:
    """Keep of triangles on the same vertices one, or ``layers`` where that closes edges."""
    distinct = distinct_rows(np.sort(triangles, axis=1))
    if len(distinct.first) == len(triangles):
        return triangles
    times = np.bincount(distinct.inverse, minlength=len(distinct.first))
    is_single = np.ones(len(distinct.first), dtype=bool)
    _decide(distinct.rows, times > 1, is_single)
    order = np.argsort(distinct.inverse, kind="stable")
    number = np.empty(len(triangles), dtype=np.int64)
    number[order] = np.arange(len(order)) - np.repeat(np.cumsum(times) - times, times)
    kept = number < np.where(is_single, 1, layers)[distinct.inverse]
    if kept.all():
        return triangles
    example = triangles[int(np.flatnonzero(~kept)[0])]
    _note(repairs, "doubled triangles", int((~kept).sum()), vertices[example].mean(axis=0))
    return triangles[kept]


def _decide(triangles: IntArray, is_free: NDArray[np.bool_], kept: NDArray[np.bool_]) -> None:
    """Decide from the border of doubled triangles inwards: an edge has an even number of them."""
    edges = edges_of(triangles)
    row = edges.rows().reshape(-1, 3)
    fixed = np.bincount(row[~is_free].reshape(-1), minlength=len(edges.counts))
    free = np.bincount(row[is_free].reshape(-1), minlength=len(edges.counts))
    # Where nothing else is, a triangle stays; so it does at the border of a sheet.
    pending = list(np.flatnonzero((free == 1) & (fixed > 0)))
    while pending:
        e = pending.pop()
        if free[e] != 1:
            continue
        half = edges.order[edges.first[e] : edges.first[e + 1]] // 3
        t = half[is_free[half]][0]
        is_free[t] = False
        kept[t] = fixed[e] % 2 == 1
        for other in row[t]:
            free[other] -= 1
            fixed[other] += kept[t]
            if free[other] == 1:
                pending.append(other)


def _without_strays(vertices: FloatArray, triangles: IntArray, repairs: list[Repair]) -> IntArray:
    """Drop open parts of triangles that all have no area."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    doubled = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    longest = np.max([((b - a) ** 2).sum(1), ((c - b) ** 2).sum(1), ((a - c) ** 2).sum(1)], axis=0)
    flat = doubled <= DEGENERATE_TRIANGLE * longest
    if not flat.any():
        return triangles
    edges = edges_of(triangles)
    label, _, _ = walk_parts(mates_of(edges), edges.start)
    solid = np.bincount(label, ~flat)[label] > 0
    if solid.all():
        return triangles
    stray = triangles[~solid]
    _note(repairs, "triangles without area", len(stray), vertices[stray[0]].mean(axis=0))
    return triangles[solid]


def _without_seams(
    vertices: FloatArray, triangles: IntArray, tolerance: float, repairs: list[Repair]
) -> IntArray:
    """Weld vertices on open edges that are within ``tolerance`` of each other."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    ends, _ = open_half_edges(triangles)
    border = np.unique(ends)
    pairs = cKDTree(vertices[border]).query_pairs(tolerance, output_type="ndarray")
    if not len(pairs):
        return triangles
    n = len(border)
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(n, n))
    _, group = connected_components(graph, directed=False)
    first = np.full(group.max() + 1, -1)
    first[group[::-1]] = border[::-1]
    target = np.arange(len(vertices))
    target[border] = first[group]
    welded = target[triangles]
    a, b, c = welded.T
    _note(
        repairs,
        "vertices welded",
        int((target[border] != border).sum()),
        vertices[border[pairs[0, 0]]],
    )
    return welded[(a != b) & (b != c) & (c != a)]


def _without_t_vertices(
    vertices: FloatArray, triangles: IntArray, tolerance: float, repairs: list[Repair]
) -> IntArray:
    """Split open edges at the ends of others that are within ``tolerance`` of them."""
    from scipy.spatial import cKDTree

    count, where = 0, None
    for _ in range(_PASSES):
        ends, half = open_half_edges(triangles)
        if not len(half):
            break
        border = np.unique(ends)
        a, b = vertices[ends[:, 0]], vertices[ends[:, 1]]
        radius = 0.5 * np.linalg.norm(b - a, axis=1) + tolerance
        near = cKDTree(vertices[border]).query_ball_point(0.5 * (a + b), radius)
        cut = np.zeros(len(triangles), dtype=bool)
        pieces = []
        for i, rows in enumerate(near):
            t = int(half[i]) // 3
            if cut[t] or len(rows) < 3:
                continue
            inner = _on_edge(vertices, ends[i], border[rows], tolerance)
            corner = triangles[t, (int(half[i]) % 3 + 2) % 3]
            inner = inner[inner != corner]
            if len(inner):
                cut[t] = True
                count, where = count + len(inner), vertices[inner[0]]
                chain = np.concatenate([[ends[i, 0]], inner, [ends[i, 1]]])
                fan = [chain[:-1], chain[1:], np.full(len(chain) - 1, corner)]
                pieces.append(np.stack(fan, axis=1))
        if not pieces:
            break
        triangles = np.concatenate([triangles[~cut], *pieces])
    if where is not None:
        _note(repairs, "T vertices", count, where)
    return triangles


def _on_edge(
    vertices: FloatArray, ends: IntArray, candidates: IntArray, tolerance: float
) -> IntArray:
    """Return the candidates that are beside an edge, between its ends, from the first on."""
    a, b = vertices[ends[0]], vertices[ends[1]]
    along = b - a
    square = float(product(along, along))
    if square <= tolerance**2:
        return candidates[:0]
    arms = vertices[candidates] - a
    s = product(arms, along) / square
    off = np.linalg.norm(arms - s[:, None] * along, axis=1)
    margin = tolerance / np.sqrt(square)
    found = np.flatnonzero((off <= tolerance) & (s > margin) & (s < 1.0 - margin))
    found = found[np.argsort(s[found], kind="stable")]
    return candidates[found]
