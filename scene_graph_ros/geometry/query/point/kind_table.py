"""The shapes of a table by kind, as points want them: in tiles of as many as there are lanes."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.query.point.hull_lanes import LANE_CORNERS
from scene_graph_ros.geometry.query.point.lane_memory import LANES
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.tables.holding import Holding
from scene_graph_ros.geometry.tables.table_arrays import empty_table, ShapeTable

__all__ = ["HeldKinds", "KindTable", "borrowed", "group_by_kind", "hold_kinds"]

_CONVEX = int(ShapeKind.CONVEX)
_MESH = int(ShapeKind.MESH)


class KindTable(NamedTuple):
    """The part of a ``ShapeTable`` for points, and its rows in tiles of one kind each."""

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


_holding = Holding("a table of group_by_kind", lambda: group_by_kind(empty_table()))
borrowed = _holding.borrowed
"""Return the table whose arrays are at places of ``hold_kinds``."""


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
