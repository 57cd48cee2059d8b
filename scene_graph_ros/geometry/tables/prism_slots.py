"""Rows of a shape table whose hulls are prisms that kernels write: below triangles of a field.

A field's prisms are as many as its triangles, so that a table has rows for as many of them only
as are measured at a time. Who measures some takes a slot for it, which in every table is a row
that nobody else writes to, and whose hull is a prism with any corners. Nothing else of a table
changes after it was built.
"""

from __future__ import annotations

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.meshes.hull import Hull
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.tables.height_grid import FLOOR, x_of, y_of
from scene_graph_ros.geometry.tables.hull_blocks import (
    face_place,
    GROUP,
    pack_blocks,
    vertex_place,
)
from scene_graph_ros.geometry.tables.table_arrays import Hulls, ShapeTable

__all__ = [
    "SLOTS",
    "free_slots",
    "leave_slot",
    "prism_origin",
    "take_slot",
    "with_slots",
    "write_prism",
]

SLOTS = 128
"""Prisms that may be measured at a time: more than threads run."""

_FACES = ((0, 1, 2), (5, 4, 3), (3, 4, 1, 0), (4, 5, 2, 1), (5, 3, 0, 2))
"""Corners of the upper triangle's face, the lower one's, and the sides', from outside; corners 3
to 5 are below 0 to 2."""
_NEIGHBORS = ((1, 2, 3), (0, 2, 4), (0, 1, 5), (0, 4, 5), (1, 3, 5), (2, 3, 4))
_PER_PRISM = 6


_free = list(range(SLOTS))
"""Slots that nobody has. Lists of Python are changed by one thread at a time."""


def free_slots() -> int:
    """Return the number of slots that are free just now."""
    return len(_free)


def take_slot() -> int:
    """Return a slot that nobody has until ``leave_slot``; RuntimeError where all are taken."""
    try:
        return _free.pop()
    except IndexError:
        raise RuntimeError(
            f"{SLOTS} searches in height fields are under way, or kept: no more at a time"
        ) from None


def leave_slot(slot: int) -> None:
    """Let others have a slot."""
    _free.append(slot)


def _prism() -> Hull:
    """Return the prism of height 1 below half of a square."""
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]])
    upper, lower = (np.column_stack([corners, np.full(3, z)]) for z in (1.0, 0.0))
    slant = np.sqrt(0.5)
    normals = np.array([[0, 0, 1], [0, 0, -1], [0, -1, 0], [1, 0, 0], [-slant, slant, 0]])
    return Hull(
        np.concatenate([upper, lower]),
        [np.array(each) for each in _NEIGHBORS],
        [np.array(each) for each in _FACES],
        normals.astype(np.float64),
        np.array([1.0, 0.0, 0.0, 1.0, 0.0]),
    )


def with_slots(table: ShapeTable, slots: int) -> ShapeTable:
    """Return a table with rows of prisms behind its own."""
    none = np.full(slots, -1, np.int32)
    first = len(table.hulls.vertex_start) - 1
    return table._replace(
        kind=np.concatenate([table.kind, np.full(slots, int(ShapeKind.CONVEX), np.int32)]),
        size=np.concatenate([table.size, np.zeros((slots, 3))]),
        hull=np.concatenate([table.hull, first + np.arange(slots, dtype=np.int32)]),
        surface=np.concatenate([table.surface, none]),
        exact=np.concatenate([table.exact, np.zeros(slots, np.bool_)]),
        lower=np.concatenate([table.lower, np.zeros((slots, 3))]),
        upper=np.concatenate([table.upper, np.ones((slots, 3))]),
        scale=np.concatenate([table.scale, np.ones(slots)]),
        hulls=_with_prisms(table.hulls, slots),
    )


def _with_prisms(hulls: Hulls, slots: int) -> Hulls:
    """Return hulls with prisms behind them, all arrays new."""
    prism, vertex = _prism(), len(hulls.vertices)
    # Of two blocks alike, what differs are places: in the second they are a block further.
    _, blocks = pack_blocks([prism, prism])
    block, second = np.split(blocks, 2)
    shift = np.where(second != block, 1.0, 0.0)
    begins = len(hulls.blocks) + len(block) * np.arange(slots)
    firsts = vertex + _PER_PRISM * np.arange(slots)
    neighbors = np.concatenate(prism.neighbors)
    corners = np.concatenate(prism.faces)

    def tiled(values: np.ndarray) -> np.ndarray:
        return np.tile(values, (slots, *(1,) * (values.ndim - 1)))

    def starts(known: np.ndarray, lengths: list[int]) -> np.ndarray:
        return np.concatenate([known, known[-1] + np.cumsum(lengths * slots)]).astype(np.int64)

    def shifted(indices: np.ndarray) -> np.ndarray:
        return (firsts[:, np.newaxis] + indices).reshape(-1)

    return Hulls(
        vertex_start=starts(hulls.vertex_start, [_PER_PRISM]),
        vertices=np.concatenate([hulls.vertices, tiled(prism.vertices)]),
        neighbor_start=starts(hulls.neighbor_start, [len(each) for each in prism.neighbors]),
        neighbors=np.concatenate([hulls.neighbors, shifted(neighbors)]),
        face_start=starts(hulls.face_start, [len(prism.faces)]),
        face_normals=np.concatenate([hulls.face_normals, tiled(prism.normals)]),
        face_offsets=np.concatenate([hulls.face_offsets, tiled(prism.offsets)]),
        face_vertex_start=starts(hulls.face_vertex_start, [len(each) for each in prism.faces]),
        face_vertices=np.concatenate([hulls.face_vertices, shifted(corners)]),
        block_start=np.concatenate([hulls.block_start, begins]).astype(np.int64),
        blocks=np.concatenate([hulls.blocks, (block + shift * begins[:, np.newaxis]).reshape(-1)]),
    )


@inlined_kernel
def prism_origin(grid, element):
    """Return the origin of a prism's own frame in G: below the first corner of its cell."""
    cell, cols = element // 2, grid.counts[0, 1]
    return x_of(grid, cell % cols), y_of(grid, cell // cols), grid.numbers[FLOOR]


@inlined_kernel
def _write_vertex(hulls, k, number, x, y, z):
    """Write a corner of hull k to all places where it is; the last one fills up the group."""
    at, last = vertex_place(hulls.block_start[k], number), GROUP if number == 5 else number + 1
    for lane in range(last - number):
        hulls.blocks[at + lane] = x
        hulls.blocks[at + lane + GROUP] = y
        hulls.blocks[at + lane + 2 * GROUP] = z
    row = hulls.vertex_start[k] + number
    hulls.vertices[row, 0], hulls.vertices[row, 1], hulls.vertices[row, 2] = x, y, z


@inlined_kernel
def _write_face(hulls, k, number, x, y, z, offset):
    """Write the plane of a face to all places where it is."""
    at, last = face_place(hulls.blocks, hulls.block_start[k], number), number + 1
    last = GROUP if number == 4 else last
    for lane in range(last - number):
        hulls.blocks[at + lane] = x
        hulls.blocks[at + lane + GROUP] = y
        hulls.blocks[at + lane + 2 * GROUP] = z
    hulls.blocks[at + 3 * GROUP] = offset
    row = hulls.face_start[k] + number
    hulls.face_normals[row, 0], hulls.face_normals[row, 1] = x, y
    hulls.face_normals[row, 2], hulls.face_offsets[row] = z, offset


@inlined_kernel
def _write_side(hulls, k, number, ax, ay, bx, by):
    """Write the plane above the edge from a to b."""
    x, y = by - ay, ax - bx
    length = np.sqrt(x * x + y * y)
    x, y = x / length, y / length
    _write_face(hulls, k, number, x, y, 0.0, x * ax + y * ay)


@inlined_kernel
def write_prism(table, row, grid, element):
    """Make the hull of a row, which this thread has taken, a prism in its own frame."""
    hulls, k = table.hulls, table.hull[row]
    cell, cols = element // 2, grid.counts[0, 1]
    i, j, floor = cell // cols, cell % cols, grid.numbers[FLOOR]
    width = x_of(grid, j + 1) - x_of(grid, j)
    depth = y_of(grid, i + 1) - y_of(grid, i)
    at = i * (cols + 1) + j
    a, c = grid.heights[at] - floor, grid.heights[at + cols + 2] - floor
    is_first = element % 2 == 0
    if is_first:
        bx, by, b = width, 0.0, grid.heights[at + 1] - floor
    else:
        bx, by, b = 0.0, depth, grid.heights[at + cols + 1] - floor
    # Counter-clockwise from above: (a, b, c) of the first triangle, (a, c, b) of the second.
    x1, y1, z1 = (bx, by, b) if is_first else (width, depth, c)
    x2, y2, z2 = (width, depth, c) if is_first else (bx, by, b)
    _write_vertex(hulls, k, 0, 0.0, 0.0, a)
    _write_vertex(hulls, k, 1, x1, y1, z1)
    _write_vertex(hulls, k, 2, x2, y2, z2)
    _write_vertex(hulls, k, 3, 0.0, 0.0, 0.0)
    _write_vertex(hulls, k, 4, x1, y1, 0.0)
    _write_vertex(hulls, k, 5, x2, y2, 0.0)
    u, v = z1 - a, z2 - a
    x, y, z = y1 * v - u * y2, u * x2 - x1 * v, x1 * y2 - y1 * x2
    length = np.sqrt(x * x + y * y + z * z)
    x, y, z = x / length, y / length, z / length
    _write_face(hulls, k, 0, x, y, z, z * a)
    _write_face(hulls, k, 1, 0.0, 0.0, -1.0, 0.0)
    _write_side(hulls, k, 2, 0.0, 0.0, x1, y1)
    _write_side(hulls, k, 3, x1, y1, x2, y2)
    _write_side(hulls, k, 4, x2, y2, 0.0, 0.0)
    top = max(a, max(b, c))
    table.upper[row, 0], table.upper[row, 1], table.upper[row, 2] = width, depth, top
    table.scale[row] = max(top, max(width, depth))
