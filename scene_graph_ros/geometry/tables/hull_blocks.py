"""Convex hulls in one array of floats, a block for each, for algorithms that visit vertices.

A block starts with HEADER numbers: how many vertices and faces there are, where its faces, its
edges and its cells start, and how many cells an edge of the cube has (``meshes.vertex_cells``).
Then come its vertices, in groups of GROUP: their x, their y, their z (m), and where the neighbors
of each are listed; the last vertex fills up the last group. A vertex' place is that of its x. A
list is its length, then where in the array the neighbors are. Faces are in groups of GROUP, too:
the x, y and z of their unit outward normals, their planes' offsets (m), and where their corners
are listed, counter-clockwise seen from outside; a face's place is that of its normal's x. Entries
that fill up the last group have the offset inf. The edges begin with their count; each is where
one of its ends is, which two of the block's faces share it, and where its other end is. They are
there for solid hulls of up to SCAN_LIMIT vertices; others have the count 0. For each cell there is
where its groups start and how many there are, then come these: of the vertices that may lie
furthest along a direction of the cell, the coordinates as above, and their places. Hulls of up to
CELL_LIMIT vertices have none. Places are indices of the whole array, as floats.
"""

from __future__ import annotations

from collections.abc import Sequence
import math

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.meshes.hull import Hull
from scene_graph_ros.geometry.meshes.vertex_cells import cell_of, VertexCells
from scene_graph_ros.geometry.tables.plane_scan import highest_of_planes, PLANE_STRIDE
from scene_graph_ros.geometry.tables.vertex_scan import (
    furthest_of_few_groups,
    furthest_of_groups,
    GROUP,
)

__all__ = [
    "EDGE_STRIDE",
    "SCAN_LIMIT",
    "corners_of_face",
    "edge_range",
    "face_place",
    "furthest_face",
    "furthest_vertex",
    "highest_face",
    "likely_vertex",
    "list_of_neighbors",
    "normal_of_face",
    "offset_of_face",
    "pack_blocks",
    "vertex",
    "vertex_number",
    "vertex_place",
]

HEADER = 8
STRIDE = 4 * GROUP
"""Numbers of a group of vertices."""
EDGE_STRIDE = 4
"""Numbers of an edge."""

SCAN_LIMIT = 32
"""Hulls up to this many vertices have their edges listed, and all their features are looked at."""


def _lists(
    rows: Sequence[NDArray[np.int64]], at: int, start: int
) -> tuple[NDArray[np.int64], NDArray[np.float64], int]:
    """Return the start of each list of vertices, all from ``at`` on, and their end."""
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
    """Return rows (v, k) in groups, one after the other; the last row fills up the last group."""
    missing = -len(rows) % GROUP
    full = np.concatenate([rows, np.repeat(rows[-1:], missing, axis=0)])
    return full.reshape(-1, GROUP, rows.shape[1]).swapaxes(1, 2).ravel()


def _faces(hull: Hull, corners_at: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return the groups of a hull's faces, whose corners are listed at these places."""
    rows = np.column_stack([hull.normals, hull.offsets, corners_at])
    groups = _groups(rows).reshape(-1, 5, GROUP)
    if len(rows) % GROUP:
        groups[-1, 3, len(rows) % GROUP :] = np.inf
    return groups.ravel()


def _cells(cells: VertexCells | None, rows: NDArray[np.float64], at: int) -> NDArray[np.float64]:
    """Return the cells that start at a place, of vertices with the rows (v, 4)."""
    if cells is None:
        return np.zeros(0)
    groups = -(-cells.counts // GROUP)
    ends = np.cumsum(groups)
    table = np.stack([at + 2 * len(groups) + STRIDE * (ends - groups), groups], axis=1)
    # Each cell's last vertex fills up its last group.
    slots = np.arange(GROUP * int(ends[-1]))
    cell = np.repeat(np.arange(len(groups)), GROUP * groups)
    slots -= GROUP * (ends - groups)[cell]
    begins = np.cumsum(cells.counts) - cells.counts
    chosen = cells.numbers[begins[cell] + np.minimum(slots, cells.counts[cell] - 1)]
    return np.concatenate([table.ravel().astype(np.float64), _groups(rows[chosen])])


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
    starts, parts, start = [], [], 0
    for hull in hulls:
        vertices, faces = len(hull.vertices), len(hull.normals)
        lists_at = start + HEADER + STRIDE * -(-vertices // GROUP)
        list_at, neighbors, faces_at = _lists(hull.neighbors, lists_at, start)
        lists_at = faces_at + PLANE_STRIDE * -(-faces // GROUP)
        corners_at, corners, edges_at = _lists(hull.faces, lists_at, start)
        edges = _edges(hull)
        edges[:, [0, 3]] = _places(start, edges[:, [0, 3]].astype(np.int64))
        cells_at = edges_at + 1 + edges.size
        rows = np.column_stack([hull.vertices, _places(start, np.arange(vertices))])
        cells = _cells(hull.cells, rows, cells_at)
        side = 0 if hull.cells is None else hull.cells.side
        parts += [
            np.array([vertices, faces, faces_at, edges_at, cells_at, side, 0.0, 0.0]),
            _groups(np.column_stack([hull.vertices, list_at])),
            neighbors,
            _faces(hull, corners_at) if faces else np.zeros(0),
            corners,
            np.array([float(len(edges))]),
            edges.ravel(),
            cells,
        ]
        starts.append(start)
        start = cells_at + cells.size
    return np.array(starts, dtype=np.int64), np.concatenate([np.zeros(0), *parts])


@inlined_kernel
def face_place(blocks, start, number):
    """Return the index of the face with a number, of the block at ``start``."""
    return int(blocks[start + 2]) + PLANE_STRIDE * (number // GROUP) + number % GROUP


@inlined_kernel
def normal_of_face(blocks, place):
    """Return the unit outward normal of the face at a place."""
    return blocks[place], blocks[place + GROUP], blocks[place + 2 * GROUP]


@inlined_kernel
def offset_of_face(blocks, place):
    """Return the offset of the plane of the face at a place (m)."""
    return blocks[place + 3 * GROUP]


@inlined_kernel
def corners_of_face(blocks, place):
    """Return the index of the list of corners of the face at an index."""
    return int(blocks[place + 4 * GROUP])


@lean_kernel
def highest_face(blocks, start, p):
    """Return (place, height, second): the face plane that p is highest above, and the runner-up.

    The first of several. Heights are in m; without faces the place is -1, the heights are -inf.
    """
    count = int(blocks[start + 1])
    if count == 0:
        return -1, -math.inf, -math.inf
    return highest_of_planes(blocks, int(blocks[start + 2]), (count + GROUP - 1) // GROUP, p)


@lean_kernel
def furthest_face(blocks, start, d):
    """Return the place of the face whose normal lies furthest along d, the first of several.

    -1 without faces.
    """
    count = int(blocks[start + 1])
    if count == 0:
        return -1
    first, groups = int(blocks[start + 2]), (count + GROUP - 1) // GROUP
    return furthest_of_groups(blocks, first, groups, d, PLANE_STRIDE)


@lean_kernel
def edge_range(blocks, start):
    """Return (where the first edge of a block is, where the last one ends)."""
    at = int(blocks[start + 3])
    return at + 1, at + 1 + EDGE_STRIDE * int(blocks[at])


@inlined_kernel
def vertex_place(start, number):
    """Return the index of the vertex with a number in the block at ``start``."""
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
    """Return the index of the list of neighbors of the vertex at an index."""
    return int(blocks[place + 3 * GROUP])


@lean_kernel
def likely_vertex(blocks, start, p):
    """Return the index of a block's vertex that is probably the nearest to p, outside of it."""
    v = vertex(blocks, start + HEADER)
    return furthest_vertex(blocks, start, (p[0] - v[0], p[1] - v[1], p[2] - v[2]))


@lean_kernel
def furthest_vertex(blocks, start, d):
    """Return the index of a block's vertex that lies furthest along d, the first of several.

    Of a hull with cells only the vertices of the cell of d are looked at.
    """
    side = int(blocks[start + 5])
    if side == 0 or not max(abs(d[0]), abs(d[1]), abs(d[2])) > 0.0:
        groups = (int(blocks[start]) + GROUP - 1) // GROUP
        return furthest_of_few_groups(blocks, start + HEADER, groups, d, STRIDE)
    cell = int(blocks[start + 4]) + 2 * cell_of(d, side)
    first, groups = int(blocks[cell]), int(blocks[cell + 1])
    best = furthest_of_groups(blocks, first, groups, d, STRIDE)
    return int(blocks[best + 3 * GROUP])
