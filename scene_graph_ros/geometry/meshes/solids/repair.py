"""Close nearly closed surfaces: doubled triangles, seams, T vertices, strays.

In this order, and only where an edge is open: vertices on open edges that are within a tolerance
of each other are welded; an edge with such a vertex beside it is split there; of triangles on the
same three vertices as many are kept as close the edges around them; open parts without an area
are dropped.

An edge is open where triangles run through it more often one way than the other. Where that comes
to nothing, since triangles run as they like, it is where an odd number of them meet: then open
edges of bodies that touch may hide each other.
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

__all__ = ["repaired", "share_turned", "without_copies", "without_doubles"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_PASSES = 24
"""An edge of each triangle is split in each; a triangle with many T vertices takes more."""


def share_turned(triangles: IntArray) -> float:
    """Return the share of the edges of (m, 3) triangles at which two or more do not run alike."""
    edges = edges_of(triangles)
    wrong = np.count_nonzero((edges.counts % 2 == 0) & (edges.balances != 0))
    return wrong / max(len(edges.counts), 1)


def repaired(
    vertices: FloatArray, triangles: IntArray, tolerance: float, *, layers: int | None
) -> tuple[IntArray, list[Repair]]:
    """Return the triangles (m, 3) over the same vertices, and the repairs.

    Args:
        vertices: (v, 3), no two equal.
        triangles: (m, 3), each of three vertices.
        tolerance: metres; how large a gap may be.
        layers: None where the ways say which edges are open. Else 2 or 0, how many of triangles
            on the same vertices are kept where an even number closes the edges around: 2 are faces
            of bodies that touch or are nested.

    """
    repairs: list[Repair] = []
    by_ways = layers is None
    if layers is not None:
        triangles = without_doubles(vertices, triangles, repairs, layers)
    triangles = _without_strays(vertices, triangles, repairs)
    if len(triangles) and len(open_half_edges(triangles, by_ways=by_ways)[1]):
        triangles = _without_seams(vertices, triangles, tolerance, repairs, by_ways)
        triangles = _without_t_vertices(vertices, triangles, tolerance, repairs, by_ways)
        if layers is None:
            triangles = _without_doubles_by_ways(vertices, triangles, repairs)
        else:
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


def _without_doubles_by_ways(
    vertices: FloatArray, triangles: IntArray, repairs: list[Repair]
) -> IntArray:
    """Keep of triangles on the same vertices as many, one way, as the edges around ask for.

    All are kept where they come to as much, so that bodies that touch have a face each.
    """
    distinct = distinct_rows(np.sort(triangles, axis=1))
    if len(distinct.first) == len(triangles):
        return triangles
    group = distinct.inverse
    # 1 where a triangle runs as its vertices ascend, else -1.
    turned = _from_lowest(triangles)
    way = np.where(turned[:, 1] < turned[:, 2], 1, -1)
    given = np.bincount(group, way).astype(np.int64)
    net = _asked_for(distinct.rows, given, np.bincount(group) > 1)
    order = np.lexsort((way, group))
    is_first = np.ones(len(order), dtype=bool)
    is_first[1:] = np.diff(group[order]) + np.abs(np.diff(way[order])) > 0
    starts = np.flatnonzero(is_first)
    number = np.empty(len(order), dtype=np.int64)
    number[order] = np.arange(len(order)) - np.repeat(starts, np.diff([*starts, len(order)]))
    kept = (net == given)[group] | ((way * net[group] > 0) & (number < np.abs(net[group])))
    if kept.all():
        return triangles
    example = triangles[int(np.flatnonzero(~kept)[0])]
    _note(repairs, "doubled triangles", int((~kept).sum()), vertices[example].mean(axis=0))
    return triangles[kept]


def _from_lowest(triangles: IntArray) -> IntArray:
    """Return triangles (m, 3) that run as they do, each from its lowest vertex on."""
    first = triangles.argmin(axis=1)[:, None]
    return np.take_along_axis(triangles, (first + np.arange(3)) % 3, axis=1)


def without_copies(vertices: FloatArray, triangles: IntArray, repairs: list[Repair]) -> IntArray:
    """Keep one of triangles on the same vertices that run the same way."""
    first = np.sort(distinct_rows(_from_lowest(triangles)).first)
    if len(first) < len(triangles):
        example = triangles[np.setdiff1d(np.arange(len(triangles)), first)[0]]
        count = len(triangles) - len(first)
        _note(repairs, "doubled triangles", count, vertices[example].mean(axis=0))
    return triangles[first]


def _asked_for(triangles: IntArray, given: IntArray, is_free: NDArray[np.bool_]) -> IntArray:
    """Return how often ascending triangles (m, 3) are to run as they do, or -1 times backwards.

    From the border of the free ones inwards: an edge is run through as often one way as the other.
    Where nothing tells, it is once, or as ``given`` (m,) where that is not at all.
    """
    edges = edges_of(triangles)
    row = edges.rows().reshape(-1, 3)
    ways = np.where(edges.start < edges.end, 1, -1).reshape(-1, 3)
    result = np.where(is_free, np.sign(given), given)
    fixed = np.bincount(row[~is_free].reshape(-1), minlength=len(edges.counts)) > 0
    sums = np.bincount(row.reshape(-1), (ways * np.where(is_free, 0, given)[:, None]).reshape(-1))
    free = np.bincount(row[is_free].reshape(-1), minlength=len(edges.counts))
    pending = list(np.flatnonzero((free == 1) & fixed))
    is_free = is_free.copy()
    while pending:
        e = pending.pop()
        if free[e] != 1:
            continue
        half = edges.order[edges.first[e] : edges.first[e + 1]]
        t = half[is_free[half // 3]][0] // 3
        is_free[t] = False
        result[t] = -sums[e] * ways[t][row[t] == e][0]
        for k in range(3):
            other = row[t, k]
            free[other] -= 1
            sums[other] += ways[t, k] * result[t]
            if free[other] == 1:
                pending.append(other)
    return result


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
    vertices: FloatArray,
    triangles: IntArray,
    tolerance: float,
    repairs: list[Repair],
    by_ways: bool,
) -> IntArray:
    """Weld vertices on open edges that are within ``tolerance`` of each other."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    ends, _ = open_half_edges(triangles, by_ways=by_ways)
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
    vertices: FloatArray,
    triangles: IntArray,
    tolerance: float,
    repairs: list[Repair],
    by_ways: bool,
) -> IntArray:
    """Split open edges at the ends of others that are within ``tolerance`` of them."""
    from scipy.spatial import cKDTree

    count, where = 0, None
    is_border = np.zeros(len(vertices), dtype=bool)
    for _ in range(_PASSES):
        ends, half = open_half_edges(triangles, by_ways=by_ways)
        if not len(half) and not is_border.any():
            break
        if by_ways:
            is_border[ends] = True
            ends, half = _edges_between(triangles, is_border)
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


def _edges_between(triangles: IntArray, is_chosen: NDArray[np.bool_]) -> tuple[IntArray, IntArray]:
    """Return the ends (k, 2) of half edges between chosen vertices, and rows, edge by edge.

    So open edges are among them that edges of other bodies hide, and triangles on the same
    vertices are cut alike.
    """
    ends = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).reshape(-1, 2)
    half = np.flatnonzero(is_chosen[ends].all(axis=1))
    ends = ends[half]
    order = np.lexsort((half, ends.max(axis=1), ends.min(axis=1)))
    return ends[order], half[order]


def _on_edge(
    vertices: FloatArray, ends: IntArray, candidates: IntArray, tolerance: float
) -> IntArray:
    """Return the candidates that are beside an edge, between its ends, from the first on."""
    a, b = vertices[ends[0]], vertices[ends[1]]
    along = b - a
    square = float(product(along, along))
    if square <= tolerance * tolerance:
        return candidates[:0]
    arms = vertices[candidates] - a
    s = product(arms, along) / square
    off = np.linalg.norm(arms - s[:, None] * along, axis=1)
    margin = tolerance / np.sqrt(square)
    found = np.flatnonzero((off <= tolerance) & (s > margin) & (s < 1.0 - margin))
    found = found[np.argsort(s[found], kind="stable")]
    return candidates[found]
