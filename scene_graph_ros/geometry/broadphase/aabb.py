"""World-aligned bounding boxes of all rows of a shape table."""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.broadphase.box_vectors import (
    bound_points,
    bound_shape,
    new_placed_rows,
    PlacedRows,
)
from scene_graph_ros.geometry.broadphase.extents import centres_of, extents_of
from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.compiled.places import LAST_PLACE
from scene_graph_ros.geometry.tables.table_arrays import ShapeTable

__all__ = ["BoxGeometry", "bound_row", "box_geometry", "place_rows", "world_boxes"]

FloatArray = NDArray[np.float64]

MAX_HULL_VERTICES = 48
"""A hull with more vertices is bounded by its turned box in G: looking at every vertex would cost
more than the pairs that the tighter box saves."""


class BoxGeometry(NamedTuple):
    """The sizes of the boxes and the centres of n rows, without poses."""

    extents: FloatArray
    """From ``extents.extents_of``."""
    points_of: NDArray[np.int64]
    """(n, 2): where the points of row i's hull start and end, if it has one."""
    points: FloatArray
    """(p, 3) in G."""
    centres: FloatArray
    """From ``extents.centres_of``."""


@inlined_kernel
def bound_row(geometry, X_WG, i, placed):
    """Write the box of row i, rounded outwards, and its centre, to PlacedRows."""
    first, last = geometry.points_of[i, 0], geometry.points_of[i, 1]
    if last > first:
        bound_points(geometry.points, first, last, geometry.centres, X_WG, i, placed)
    else:
        bound_shape(geometry.extents, geometry.centres, X_WG, i, placed)


@lean_kernel
def _bound_rows(geometry, X_WG, placed):
    for i in range(len(placed.lower)):
        bound_row(geometry, X_WG, i & LAST_PLACE, placed)


def box_geometry(table: ShapeTable) -> BoxGeometry:
    """Return the geometry of the boxes of a table's rows."""
    start, vertices = table.hulls.vertex_start, table.hulls.vertices
    points = [np.empty((0, 3))]
    ranges, count = np.zeros((len(start), 2), np.int64), 0  # the last one is that of no hull
    for hull, (first, last) in enumerate(itertools.pairwise(start)):
        given = vertices[first:last]
        if len(given) > MAX_HULL_VERTICES:
            bounds = zip(given.min(axis=0), given.max(axis=0), strict=True)
            given = np.array(list(itertools.product(*bounds)))
        points.append(given)
        ranges[hull] = count, count + len(given)
        count += len(given)
    return BoxGeometry(
        extents_of(table), ranges[table.hull], np.concatenate(points), centres_of(table)
    )


def place_rows(geometry: BoxGeometry, X_WG: FloatArray) -> PlacedRows:
    """Return the boxes, rounded outwards, and the centres of all rows at poses (n, 4, 4)."""
    placed = new_placed_rows(len(X_WG))
    _bound_rows(geometry, X_WG, placed)
    return placed


def world_boxes(table: ShapeTable, X_WG: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Bound every shape of the table, rounded outwards.

    Args:
        table: ShapeTable of n rows.
        X_WG: (n, 4, 4) poses.

    Returns:
        lower and upper (n, 3), in metres in W; infinite for half spaces. Tight for primitives and
        for hulls of up to MAX_HULL_VERTICES vertices.

    """
    placed = place_rows(box_geometry(table), X_WG)
    return np.ascontiguousarray(placed.lower[:, :3]), np.ascontiguousarray(placed.upper[:, :3])
