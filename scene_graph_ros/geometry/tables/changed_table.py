"""The shape table of a scene in which little has changed since the last one."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.shapes.mesh_shape import MeshShape
from scene_graph_ros.geometry.shapes.shape import Shape
from scene_graph_ros.geometry.tables.shape_table import build_shape_table
from scene_graph_ros.geometry.tables.table_arrays import ShapeTable

__all__ = ["TableOfShapes", "changed_table"]


class TableOfShapes(NamedTuple):
    """A shape table, and its sources."""

    table: ShapeTable
    shapes: Sequence[Shape]
    exact: Sequence[bool]


def changed_table(
    before: TableOfShapes | None, shapes: Sequence[Shape], exact: Sequence[bool]
) -> TableOfShapes:
    """Return the same as ``build_shape_table``, with the rows of shapes that were there before.

    Hulls and surfaces stay as they are while the meshes are the same, in the same order: to pack
    them anew for each sphere that comes or goes takes seconds where they are large.
    """
    table = None if before is None else _with_known_rows(before, shapes, exact)
    if table is None:
        table = build_shape_table(shapes, exact)
    return TableOfShapes(table, shapes, exact)


def _with_known_rows(
    before: TableOfShapes, shapes: Sequence[Shape], exact: Sequence[bool]
) -> ShapeTable | None:
    """Return the table with the rows from before; None where its meshes are others."""
    # The shapes before are kept, so that no other has got the id of one of them.
    rows = {key: row for row, key in enumerate(_keys(before.shapes, before.exact))}
    known = [rows.get(key, -1) for key in _keys(shapes, exact)]
    row_before = np.array(known, dtype=np.int64)
    new = np.flatnonzero(row_before < 0).tolist()
    if len(new) == len(shapes) or any(isinstance(shapes[i], MeshShape) for i in new):
        return None
    if not _has_all_hulls(before.table, row_before[row_before >= 0]):
        return None
    fresh = build_shape_table([shapes[i] for i in new], [exact[i] for i in new])
    columns = {}
    for name in ("kind", "size", "hull", "surface", "exact", "lower", "upper", "scale"):
        column = getattr(before.table, name)[row_before]
        column[new] = getattr(fresh, name)
        columns[name] = column
    return before.table._replace(**columns)


def _keys(shapes: Sequence[Shape], exact: Sequence[bool]) -> Iterator[tuple[int, bool]]:
    return zip(map(id, shapes), exact, strict=True)


def _has_all_hulls(table: ShapeTable, rows: NDArray[np.int64]) -> bool:
    """Tell whether some rows of a table have all its hulls, in the order of the hulls."""
    hulls = table.hull[rows]
    used = dict.fromkeys(hulls[hulls >= 0].tolist())
    return list(used) == list(range(len(table.hulls.vertex_start) - 1))
