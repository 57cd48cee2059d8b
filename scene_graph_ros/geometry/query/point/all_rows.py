"""Signed distance from points to all rows, none left out.

Many points are measured to one shape at a time (``many_points``), few points to as many shapes of
one kind at a time as there are lanes.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, kernel, lean_kernel
from scene_graph_ros.geometry.compiled.places import LAST_PLACE
from scene_graph_ros.geometry.query.point.answers import Answers
from scene_graph_ros.geometry.query.point.dispatch import point_mesh_within
from scene_graph_ros.geometry.query.point.ellipsoid_lanes import answer_ellipsoids
from scene_graph_ros.geometry.query.point.hull_lanes import answer_hulls, LANE_CORNERS
from scene_graph_ros.geometry.query.point.lane_memory import lane_numbers, LANES
from scene_graph_ros.geometry.query.point.lanes import (
    answer_closed_form,
    enter_frames,
    leave_frames,
    read_lane,
    take_poses,
)
from scene_graph_ros.geometry.query.point.many_points import answer_many_points
from scene_graph_ros.geometry.query.point.point_convex import point_hull
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.spatial.vectors import (
    load_rotation,
    load_translation,
    load_vector,
    rotate,
    rotate_inverse,
    subtract,
)
from scene_graph_ros.geometry.tables.holding import Holding
from scene_graph_ros.geometry.tables.shape_table import build_shape_table, ShapeTable

__all__ = ["HeldKinds", "KindTable", "answer_all", "group_by_kind", "hold_kinds"]

_CONVEX = int(ShapeKind.CONVEX)
_MESH = int(ShapeKind.MESH)
_ELLIPSOID = int(ShapeKind.ELLIPSOID)

_SEEN_AGAIN = 1 << 16
"""Answers, of 57 bytes each: so many may still be in the caches when somebody reads them."""


class KindTable(NamedTuple):
    """What points need of a ``ShapeTable``, and its rows in tiles of one kind each."""

    kind: np.ndarray
    """(n,) int32, as in the table."""
    size: np.ndarray
    """(n, 3) metres, as in the table, but for the extent of a hull in the first place."""
    block: np.ndarray
    """(n,) int64: where the row's hull starts in ``blocks``, or -1."""
    blocks: np.ndarray
    """(P,) float64: the table's ``hulls.blocks``."""
    tile_rows: np.ndarray
    """(tiles, LANES) int64: rows of one kind, the last again where it has too few. Tiles whose
    rows are near each other follow each other, so that their answers are in the first cache."""
    tile_sizes: np.ndarray
    """(tiles, 3 * LANES) metres: the sizes of each tile's rows, as lanes."""
    tile_hulls: np.ndarray
    """(tiles,) int64: where a tile of hulls has its corners in the next two, or -1."""
    corner_count: np.ndarray
    """(hull tiles,) int64: how many corners the hulls of a tile have at most."""
    corners: np.ndarray
    """(hull tiles, LANE_CORNERS, 3, LANES) metres: their corners, as ``hull_lanes`` wants."""
    large_hulls: np.ndarray
    """Rows of hulls with too many corners for a tile."""
    meshes: np.ndarray
    """Rows of meshes."""


def group_by_kind(table: ShapeTable) -> KindTable:
    """Return the columns of a table that points need."""
    hulls, has_hull = table.hulls, table.hull >= 0
    counts, block = np.zeros(len(table.kind), np.int64), np.full(len(table.kind), -1, np.int64)
    counts[has_hull] = np.diff(hulls.vertex_start)[table.hull[has_hull]]
    block[has_hull] = hulls.block_start[table.hull[has_hull]]
    is_large = (table.kind == _CONVEX) & (counts > LANE_CORNERS)
    order = np.lexsort((counts, table.kind)).astype(np.int64)
    order = order[(table.kind[order] < _MESH) & ~is_large[order]]
    tiles = [_tiles(order[table.kind[order] == kind]) for kind in range(_MESH)]
    of_hulls = tiles[_CONVEX]
    hull_numbers = [np.full(len(of_kind), -1) for of_kind in tiles]
    hull_numbers[_CONVEX] = np.arange(len(of_hulls))
    rows = np.concatenate(tiles)
    along = np.argsort(rows.sum(axis=1), kind="stable")
    rows = rows[along]
    size = table.size.copy()
    size[has_hull, 0] = table.scale[has_hull]
    return KindTable(
        kind=table.kind,
        size=size,
        block=block,
        blocks=hulls.blocks,
        tile_rows=rows,
        tile_sizes=_as_lanes(size[rows]),
        tile_hulls=np.concatenate(hull_numbers).astype(np.int64)[along],
        corner_count=counts[of_hulls].max(axis=1, initial=0),
        corners=_corners(table, of_hulls),
        large_hulls=np.flatnonzero(is_large),
        meshes=np.flatnonzero(table.kind == _MESH),
    )


class HeldKinds(NamedTuple):
    """A table by kind, and where its arrays are."""

    kinds: KindTable
    places: Any


_holding = Holding("a table of group_by_kind", lambda: group_by_kind(build_shape_table([], [])))
_borrowed = _holding.borrowed


def hold_kinds(kinds: KindTable) -> HeldKinds:
    """Write down where the arrays of a table of ``group_by_kind`` are."""
    return HeldKinds(kinds, _holding.places(kinds))


def _tiles(rows: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return rows in tiles, the last one again until its tile is full."""
    missing = -len(rows) % LANES
    return np.concatenate([rows, np.repeat(rows[-1:], missing)]).reshape(-1, LANES)


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
def _write(columns, at, phi, nearest, gradient, is_unique):
    at &= LAST_PLACE
    columns[0][at], columns[3][at] = phi, is_unique
    at = (3 * at) & LAST_PLACE
    for axis in range(3):
        columns[1][at + axis] = nearest[axis]
        columns[2][at + axis] = gradient[axis]


@inlined_kernel
def _answer_tile(kinds, tile, lanes):
    """Answer all lanes about the shapes of a tile."""
    k = kinds.tile_hulls[tile]
    kind = kinds.kind[kinds.tile_rows[tile, 0]]
    if kind == _ELLIPSOID:
        answer_ellipsoids(lanes)
    elif kind != _CONVEX:
        answer_closed_form(lanes, kind)
    else:
        answer_hulls(
            lanes, kinds.corners, k, kinds.corner_count[k],
            kinds.blocks, kinds.block, kinds.tile_rows, tile,
        )  # fmt: skip


@lean_kernel
def _answer_tiles(kinds, X_WG, p_WQs, first, last, columns):
    """Answer points first to last about all rows in tiles."""
    n = X_WG.shape[0]
    lanes, poses = lane_numbers(), lane_numbers()
    for tile in range(kinds.tile_rows.shape[0]):
        take_poses(X_WG, kinds.tile_rows, tile, poses)
        for q in range(first, last):
            enter_frames(lanes, kinds.tile_sizes, tile, poses, load_vector(p_WQs, q))
            _answer_tile(kinds, tile, lanes)
            leave_frames(lanes, poses)
            for j in range(LANES):
                phi, nearest, gradient, unique = read_lane(lanes, j)
                _write(columns, q * n + kinds.tile_rows[tile, j], phi, nearest, gradient, unique)


@lean_kernel
def _answer_large_hulls(kinds, X_WG, p_WQs, first, last, columns):
    n = X_WG.shape[0]
    for slot in range(kinds.large_hulls.shape[0]):
        i = kinds.large_hulls[slot]
        R_WG, p_WG = load_rotation(X_WG, i), load_translation(X_WG, i)
        for q in range(first, last):
            p_GQ = rotate_inverse(R_WG, subtract(load_vector(p_WQs, q), p_WG))
            phi, nearest, gradient, unique = point_hull(
                kinds.blocks, kinds.block[i], kinds.size[i, 0], p_GQ
            )
            _write(columns, q * n + i, phi, nearest, rotate(R_WG, gradient), unique)


@lean_kernel
def _answer_few_points(places, X_WG, p_WQs, first, last, columns):
    """Answer points first to last about all rows but meshes."""
    kinds = _borrowed(places)
    _answer_tiles(kinds, X_WG, p_WQs, first, last, columns)
    _answer_large_hulls(kinds, X_WG, p_WQs, first, last, columns)


@lean_kernel
def _answer_many_points(places, X_WG, p_WQs, first, last, is_large, columns):
    """Do the same many points at a time."""
    answer_many_points(_borrowed(places), X_WG, p_WQs, first, last, is_large, columns)


@kernel
def _answer_meshes(table, rows, X_WG, p_WQs, first, last, columns):
    n = X_WG.shape[0]
    for q in range(first, last):
        p_WQ = load_vector(p_WQs, q)
        for slot in range(rows.shape[0]):
            i = rows[slot]
            R_WG = load_rotation(X_WG, i)
            p_GQ = rotate_inverse(R_WG, subtract(p_WQ, load_translation(X_WG, i)))
            phi, nearest, gradient, unique = point_mesh_within(table, i, p_GQ, math.inf)
            _write(columns, q * n + i, phi, nearest, rotate(R_WG, gradient), unique)


def answer_all(
    table: ShapeTable,
    held: HeldKinds,
    X_WG: NDArray[np.float64],
    p_WQs: NDArray[np.float64],
    points: range,
    columns: Answers,
) -> None:
    """Write the answers of a range of points about all n rows into columns for all points.

    Point q and row i have the place ``q * n + i``.
    """
    kinds, places = held
    first, last, tiles = points.start, points.stop, len(kinds.tile_rows)
    many = last - len(points) % LANES
    if len(X_WG) <= (last - many) * tiles:  # so many points fill the lanes better than shapes do
        many = last
    if first < many:
        is_large = len(columns[0]) > _SEEN_AGAIN
        _answer_many_points(places, X_WG, p_WQs, first, many, is_large, columns)
    if many < last:
        _answer_few_points(places, X_WG, p_WQs, many, last, columns)
    if len(kinds.meshes):
        _answer_meshes(table, kinds.meshes, X_WG, p_WQs, first, last, columns)
