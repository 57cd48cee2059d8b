"""Convex hulls in one array of floats, a block for each, for algorithms that visit vertices.

A block starts with four numbers: how many vertices and faces there are, where its faces and where
its edges start; then for each of SECTORS parts of the sphere the vertex furthest along its middle,
where a climb to the furthest vertex begins. Then come its vertices, in groups of GROUP: their x,
their y, their z (m), and where the neighbors of each are listed; the last vertex fills up the last
group. A vertex' place is that of its x. A list is its length, then where in the array the
neighbors are. A face is its unit outward normal, its plane's offset (m), and where its corners are
listed, counter-clockwise seen from outside. The edges begin with their count; each is where one of
its ends is, which two of the block's faces share it, and where its other end is. They are there
for solid hulls of up to SCAN_LIMIT vertices; others have the count 0. Places are
indices of the whole array, as floats.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.meshes.hull import Hull
from scene_graph_ros.geometry.tables.vertex_scan import furthest_of_groups, GROUP

__all__ = [
    "EDGE_STRIDE",
    "FACE_STRIDE",
    "SCAN_LIMIT",
    "edge_range",
    "face_range",
    "furthest_vertex",
    "likely_vertex",
    "list_of_neighbors",
    "pack_blocks",
    "vertex",
    "vertex_number",
    "vertex_place",
]

SECTORS = 24
"""A sector has directions of the same signs and largest component, 36 degrees about its middle."""

HEADER = 4 + SECTORS
STRIDE = 4 * GROUP
"""Numbers of a group of vertices."""
FACE_STRIDE = 5
"""Numbers of a face."""
EDGE_STRIDE = 4
"""Numbers of an edge."""

SCAN_LIMIT = 32
"""Hulls up to this many vertices have their edges listed, and all their features are looked at."""

CLIMB_LIMIT = 512
"""Hulls up to this many vertices are scanned for the furthest one: in order, which the processor
foresees. In larger ones a climb over the edges is faster."""


def _middles() -> NDArray[np.float64]:
    """Return the (SECTORS, 3) middle directions, in the order of ``_sector``."""
    signs = np.array([[1.0 if o >> k & 1 else -1.0 for k in range(3)] for o in range(8)])
    shares = np.ones((3, 3)) + np.eye(3)
    return np.array((signs[:, None, :] * shares[None, :, :]).reshape(SECTORS, 3))


def _lists(
    rows: Sequence[NDArray[np.int64]], at: int, start: int
) -> tuple[NDArray[np.int64], NDArray[np.float64], int]:
    """Return where each list of vertices is, all lists from ``at`` on, and where they end."""
    lengths = np.array([len(row) for row in rows], dtype=np.int64)
    ends = np.cumsum(lengths + 1)
    begins = ends - lengths - 1
    lists = np.empty(len(ends) and ends[-1], dtype=np.float64)
    is_length = np.zeros(len(lists), dtype=bool)
    is_length[begins] = True
    lists[is_length] = lengths
    lists[~is_length] = _places(start, np.concatenate([np.zeros(0, dtype=np.int64), *rows]))
    return at + begins, lists, at + len(lists)


def _places(start: int, numbers: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the places of the vertices with these numbers in the block at ``start``."""
    result: NDArray[np.int64] = start + HEADER + STRIDE * (numbers // GROUP) + numbers % GROUP
    return result


def _groups(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the vertices' rows (v, 4) in groups, one after the other."""
    missing = -len(rows) % GROUP
    full = np.concatenate([rows, np.repeat(rows[-1:], missing, axis=0)])
    return full.reshape(-1, GROUP, 4).swapaxes(1, 2).ravel()


def _edges(hull: Hull) -> NDArray[np.float64]:
    """Return the (e, 4) edges (vertex, face, face, vertex) of a hull, none if it has many."""
    if len(hull.vertices) > SCAN_LIMIT or len(hull.normals) < 4:
        return np.zeros((0, EDGE_STRIDE))
    face_of = {
        (int(a), int(b)): f
        for f, corners in enumerate(hull.faces)
        for a, b in zip(corners, np.roll(corners, -1), strict=True)
    }
    pairs = [(a, f, face_of.get((b, a)), b) for (a, b), f in face_of.items() if a < b]
    if 2 * len(pairs) != len(face_of) or any(twin is None for _, _, twin, _ in pairs):
        return np.zeros((0, EDGE_STRIDE))
    return np.array(pairs, dtype=np.float64)


def pack_blocks(
    hulls: Sequence[Hull],
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return (block_start (h,), blocks (P,)) of hulls."""
    starts, parts, start, middles = [], [], 0, _middles()
    for hull in hulls:
        vertices, faces = len(hull.vertices), len(hull.normals)
        lists_at = start + HEADER + STRIDE * -(-vertices // GROUP)
        list_at, neighbors, faces_at = _lists(hull.neighbors, lists_at, start)
        corners_at, corners, edges_at = _lists(hull.faces, faces_at + FACE_STRIDE * faces, start)
        edges = _edges(hull)
        edges[:, [0, 3]] = _places(start, edges[:, [0, 3]].astype(np.int64))
        parts += [
            np.array([vertices, faces, faces_at, edges_at]),
            _places(start, np.argmax(hull.vertices @ middles.T, axis=0)).astype(np.float64),
            _groups(np.column_stack([hull.vertices, list_at])),
            neighbors,
            np.column_stack([hull.normals, hull.offsets, corners_at]).ravel()
            if faces
            else np.zeros(0),
            corners,
            np.array([float(len(edges))]),
            edges.ravel(),
        ]
        starts.append(start)
        start = edges_at + 1 + edges.size
    return np.array(starts, dtype=np.int64), np.concatenate([np.zeros(0), *parts])


@lean_kernel
def face_range(blocks, start):
    """Return (where the first face of a block is, where the last one ends)."""
    first = int(blocks[start + 2])
    return first, first + FACE_STRIDE * int(blocks[start + 1])


@lean_kernel
def edge_range(blocks, start):
    """Return (where the first edge of a block is, where the last one ends)."""
    at = int(blocks[start + 3])
    return at + 1, at + 1 + EDGE_STRIDE * int(blocks[at])


@inlined_kernel
def vertex_place(start, number):
    """Return where the vertex with a number is in the block at ``start``."""
    return start + HEADER + STRIDE * (number // GROUP) + number % GROUP


@inlined_kernel
def vertex_number(start, place):
    """Return the number of the vertex at a place of the block at ``start``."""
    at = place - start - HEADER
    return GROUP * (at // STRIDE) + at % STRIDE


@inlined_kernel
def vertex(blocks, place):
    """Return the vertex at a place."""
    return blocks[place], blocks[place + GROUP], blocks[place + 2 * GROUP]


@inlined_kernel
def list_of_neighbors(blocks, place):
    """Return where the list of the neighbors of the vertex at a place is."""
    return int(blocks[place + 3 * GROUP])


@lean_kernel
def _along(blocks, k, d):
    v = vertex(blocks, k)
    return v[0] * d[0] + v[1] * d[1] + v[2] * d[2]


@lean_kernel
def _sector(d):
    """Return the sector that the direction d is in."""
    x, y, z = abs(d[0]), abs(d[1]), abs(d[2])
    axis = 2
    if x >= y and x >= z:
        axis = 0
    elif y >= z:
        axis = 1
    return 3 * (int(d[0] > 0.0) + 2 * int(d[1] > 0.0) + 4 * int(d[2] > 0.0)) + axis


@lean_kernel
def likely_vertex(blocks, start, p):
    """Return where a vertex of a block is that is probably the nearest to p, outside of it."""
    v = vertex(blocks, start + HEADER)
    way = (p[0] - v[0], p[1] - v[1], p[2] - v[2])
    if int(blocks[start]) <= SCAN_LIMIT:
        return furthest_vertex(blocks, start, way, -1)
    return int(blocks[start + 4 + _sector(way)])


@lean_kernel
def furthest_vertex(blocks, start, d, hint):
    """Return where the vertex of a block is that lies furthest along d.

    Most hulls are scanned. Large ones are climbed along their edges, from the vertex furthest
    along the sector of d, or from ``hint`` (the place of a vertex, or -1) if that lies further; a
    vertex no neighbor of which lies further is furthest, because the hull is convex. Each step
    gains, so there are at most as many steps as vertices.
    """
    first = start + HEADER
    count = int(blocks[start])
    groups = (count + GROUP - 1) // GROUP
    if count <= CLIMB_LIMIT:
        return furthest_of_groups(blocks, first, groups, d[0], d[1], d[2])
    best = int(blocks[start + 4 + _sector(d)])
    height = _along(blocks, best, d)
    if first <= hint < first + STRIDE * groups:
        along = _along(blocks, hint, d)
        if along > height:
            best, height = hint, along
    for _ in range(count):
        before = best
        neighbors = list_of_neighbors(blocks, before)
        for slot in range(neighbors + 1, neighbors + 1 + int(blocks[neighbors])):
            k = int(blocks[slot])
            along = _along(blocks, k, d)
            if along > height:
                best = k
                height = along
        if best == before:
            break
    return best
