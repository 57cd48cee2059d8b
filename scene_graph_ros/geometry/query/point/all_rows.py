"""Signed distance from points to all rows, none left out: rows of one kind at a time."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.jit import inlined_kernel, kernel, lean_kernel
from scene_graph_ros.geometry.meshes.scratch import lane_numbers, lane_rows, LANES
from scene_graph_ros.geometry.meshes.shape_table import ShapeTable
from scene_graph_ros.geometry.query.point.dispatch import point_mesh_within
from scene_graph_ros.geometry.query.point.hull_lanes import (
    answer_hull_lanes,
    is_answered,
    LANE_CORNERS,
)
from scene_graph_ros.geometry.query.point.lanes import (
    answer_lanes,
    clear_lanes,
    enter_frames,
    leave_frames,
    POSE_NUMBERS,
    question,
    read_lane,
    set_answer,
    write_lane,
    write_pose,
)
from scene_graph_ros.geometry.query.point.point_convex import point_hull
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.spatial.vectors import (
    load_rotation,
    load_translation,
    load_vector,
    rotate,
    rotate_inverse,
    store_vector,
    subtract,
)

__all__ = ["KindTable", "answer_all", "group_by_kind"]

_CONVEX = int(ShapeKind.CONVEX)
_MESH = int(ShapeKind.MESH)

_BLOCK = 1 << 12
"""Answers. Points are taken so many at a time that what is written about them, kind after kind,
stays in the processor's second cache meanwhile; 73 bytes each."""


class KindTable(NamedTuple):
    """What points need of a ``ShapeTable``, its rows grouped by kind."""

    order: np.ndarray
    """(n,) int64: rows by kind, hulls also by their number of corners."""
    start: np.ndarray
    """(kinds+1,) int64: the rows of a kind are ``order[start[kind]:start[kind+1]]``."""
    size: np.ndarray
    """(n, 3) metres, as in the table, but for the extent of a hull in the first place."""
    tile_start: np.ndarray
    """(kinds+1,) int64: as many rows of a kind as fill lanes are a tile; a kind has the tiles
    ``tile_start[kind]`` to ``tile_start[kind+1]``, and those of its rows that are left over."""
    tile_sizes: np.ndarray
    """(tiles, 3 * LANES) metres: the sizes of each tile's rows, as lanes."""
    block: np.ndarray
    """(n,) int64: where the row's hull starts in ``blocks``, or -1."""
    blocks: np.ndarray
    """(P,) float64: the table's ``hulls.blocks``."""
    corner_count: np.ndarray
    """(hull tiles,) int64: how many corners the hulls of a tile have at most."""
    corners: np.ndarray
    """(hull tiles, LANE_CORNERS, 3, LANES) metres: their corners, as ``hull_lanes`` wants."""


def group_by_kind(table: ShapeTable) -> KindTable:
    """Return the columns of a table that points need."""
    hulls, has_hull = table.hulls, table.hull >= 0
    counts, block = np.zeros(len(table.kind), np.int64), np.full(len(table.kind), -1, np.int64)
    counts[has_hull] = np.diff(hulls.vertex_start)[table.hull[has_hull]]
    block[has_hull] = hulls.block_start[table.hull[has_hull]]
    order = np.lexsort((counts, table.kind)).astype(np.int64)
    start = np.searchsorted(table.kind[order], np.arange(max(ShapeKind) + 2)).astype(np.int64)
    tiles = np.diff(start) // LANES
    small = (table.kind == _CONVEX) & (counts <= LANE_CORNERS)
    tiles[_CONVEX], tiles[_MESH] = np.count_nonzero(small) // LANES, 0
    in_tiles = np.concatenate(
        [order[first : first + LANES * n] for first, n in zip(start, tiles, strict=False)]
    ).reshape(-1, LANES)
    tile_start = np.concatenate([[0], np.cumsum(tiles)]).astype(np.int64)
    of_hulls = in_tiles[tile_start[_CONVEX] :]
    size = table.size.copy()
    size[has_hull, 0] = table.scale[has_hull]
    return KindTable(
        order=order,
        start=start,
        size=size,
        tile_start=tile_start,
        tile_sizes=_as_lanes(size[in_tiles]),
        block=block,
        blocks=hulls.blocks,
        corner_count=counts[of_hulls].max(axis=1, initial=0),
        corners=_corners(table, of_hulls),
    )


def _corners(table: ShapeTable, rows: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return the corners of the hulls of ``rows``, the first again where there are fewer."""
    starts = table.hulls.vertex_start
    first = starts[table.hull[rows]]
    last = starts[table.hull[rows] + 1]
    places = first[..., None] + np.arange(LANE_CORNERS)
    places = np.where(places < last[..., None], places, first[..., None])
    return np.ascontiguousarray(table.hulls.vertices[places].transpose(0, 2, 3, 1))


def _as_lanes(numbers: NDArray[np.float64]) -> NDArray[np.float64]:
    """Turn (tiles, LANES, k) numbers into (tiles, k * LANES)."""
    tiles, lanes, count = numbers.shape
    return np.ascontiguousarray(numbers.transpose(0, 2, 1)).reshape(tiles, count * lanes)


@inlined_kernel
def _write(columns, at, R_WG, answer):
    _, _, phi, p_GN, grad_W, unique = columns
    phi[at], nearest, gradient, unique[at] = answer
    store_vector(p_GN, at, nearest)
    store_vector(grad_W, at, rotate(R_WG, gradient))


@inlined_kernel
def _answer_hulls_in_lanes(kinds, slot, tile, lanes):
    """Answer lanes about the hulls of a tile, one by one where a few steps do not."""
    tile -= kinds.tile_start[_CONVEX]
    answer_hull_lanes(lanes, kinds.corners, tile, kinds.corner_count[tile])
    for j in range(LANES):
        if not is_answered(lanes, j):
            size, p_GQ = question(lanes, j)
            start = kinds.block[kinds.order[slot + j]]
            set_answer(lanes, j, point_hull(kinds.blocks, start, size[0], p_GQ))


@inlined_kernel
def _answer_tiles(kinds, kind, n, poses, p_WQs, first, last, lanes, columns):
    """Answer points first to last about the tiles of one kind: one point and a tile at a time."""
    _, _, phi, p_GN, grad_W, unique = columns
    slot = kinds.start[kind]
    for tile in range(kinds.tile_start[kind], kinds.tile_start[kind + 1]):
        for q in range(first, last):
            enter_frames(lanes, kinds.tile_sizes, poses, tile, load_vector(p_WQs, q))
            if kind == _CONVEX:
                _answer_hulls_in_lanes(kinds, slot, tile, lanes)
            else:
                answer_lanes(lanes, kind, LANES)
            leave_frames(lanes, poses, tile)
            for j in range(LANES):
                at = q * n + kinds.order[slot + j]
                phi[at], nearest, gradient, unique[at] = read_lane(lanes, j)
                store_vector(p_GN, at, nearest)
                store_vector(grad_W, at, gradient)
        slot += LANES


@inlined_kernel
def _lay_out_poses(kinds, X_WG, poses):
    """Write the poses of the rows in tiles as lanes."""
    for kind in range(kinds.start.shape[0] - 1):
        slot = kinds.start[kind]
        for tile in range(kinds.tile_start[kind], kinds.tile_start[kind + 1]):
            for j in range(LANES):
                i = kinds.order[slot + j]
                write_pose(poses, tile, j, load_rotation(X_WG, i), load_translation(X_WG, i))
            slot += LANES


@inlined_kernel
def _empty_lanes(lanes, places, kind, count, X_WG, columns):
    """Answer lanes and write the answers where ``places`` tells."""
    answer_lanes(lanes, kind, count)
    for j in range(count):
        R_WG = load_rotation(X_WG, places[LANES + j])
        _write(columns, places[j], R_WG, read_lane(lanes, j))


@inlined_kernel
def _answer_left_over(kinds, kind, X_WG, p_WQs, first, last, lanes, places, columns):
    """Answer points first to last about the rows of one kind that are in no tile."""
    n, count = X_WG.shape[0], 0
    tiles = kinds.tile_start[kind + 1] - kinds.tile_start[kind]
    for slot in range(kinds.start[kind] + LANES * tiles, kinds.start[kind + 1]):
        i = kinds.order[slot]
        R_WG, p_WG = load_rotation(X_WG, i), load_translation(X_WG, i)
        size = load_vector(kinds.size, i)
        for q in range(first, last):
            p_GQ = rotate_inverse(R_WG, subtract(load_vector(p_WQs, q), p_WG))
            write_lane(lanes, count, size, p_GQ)
            places[count], places[LANES + count] = q * n + i, i
            count += 1
            if count == LANES:
                _empty_lanes(lanes, places, kind, count, X_WG, columns)
                count = 0
    if count > 0:
        _empty_lanes(lanes, places, kind, count, X_WG, columns)


@inlined_kernel
def _answer_other_hulls(kinds, X_WG, p_WQs, first, last, columns):
    n = X_WG.shape[0]
    tiles = kinds.tile_start[_CONVEX + 1] - kinds.tile_start[_CONVEX]
    for slot in range(kinds.start[_CONVEX] + LANES * tiles, kinds.start[_CONVEX + 1]):
        i = kinds.order[slot]
        R_WG, p_WG = load_rotation(X_WG, i), load_translation(X_WG, i)
        for q in range(first, last):
            p_GQ = rotate_inverse(R_WG, subtract(load_vector(p_WQs, q), p_WG))
            answer = point_hull(kinds.blocks, kinds.block[i], kinds.size[i, 0], p_GQ)
            _write(columns, q * n + i, R_WG, answer)


@lean_kernel
def _answer_rows(kinds, X_WG, p_WQs, labels, first, last, poses, columns):
    """Answer points first to last about all rows but meshes, and write all labels.

    ``poses`` is room for the poses of all tiles.
    """
    n = X_WG.shape[0]
    point, label = columns[0], columns[1]
    lanes, places = lane_numbers(), lane_rows()
    clear_lanes(lanes)
    _lay_out_poses(kinds, X_WG, poses)
    step = max(_BLOCK // max(n, 1), 1)
    for begin in range(first, last, step):
        end = min(begin + step, last)
        for q in range(begin, end):
            for i in range(n):
                point[q * n + i] = q
                label[q * n + i] = labels[i]
        for kind in range(kinds.start.shape[0] - 1):
            _answer_tiles(kinds, kind, n, poses, p_WQs, begin, end, lanes, columns)
            if kind == _CONVEX:
                _answer_other_hulls(kinds, X_WG, p_WQs, begin, end, columns)
            elif kind != _MESH:
                _answer_left_over(kinds, kind, X_WG, p_WQs, begin, end, lanes, places, columns)


@kernel
def _answer_meshes(table, rows, X_WG, p_WQs, first, last, columns):
    n = X_WG.shape[0]
    for q in range(first, last):
        p_WQ = load_vector(p_WQs, q)
        for slot in range(rows.shape[0]):
            i = rows[slot]
            R_WG = load_rotation(X_WG, i)
            p_GQ = rotate_inverse(R_WG, subtract(p_WQ, load_translation(X_WG, i)))
            _write(columns, q * n + i, R_WG, point_mesh_within(table, i, p_GQ, math.inf))


def answer_all(
    table: ShapeTable,
    kinds: KindTable,
    X_WG: NDArray[np.float64],
    p_WQs: NDArray[np.float64],
    labels: NDArray[np.int64],
    points: range,
    columns: tuple[NDArray[Any], ...],
) -> None:
    """Write the answers of a range of points about all n rows into columns for all points.

    The columns are those of ``distance_points``, ``labels[i]`` in place of row i.
    """
    poses = np.empty((len(kinds.tile_sizes), POSE_NUMBERS * LANES))
    _answer_rows(kinds, X_WG, p_WQs, labels, points.start, points.stop, poses, columns)
    first, last = kinds.start[_MESH : _MESH + 2].tolist()
    if first < last:
        meshes = kinds.order[first:last]
        _answer_meshes(table, meshes, X_WG, p_WQs, points.start, points.stop, columns)
