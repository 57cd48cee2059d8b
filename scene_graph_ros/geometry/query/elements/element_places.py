"""A scene's shape table with rows for points and clouds, and where their trees are, as one array.

A row for a point, and rows for clouds, follow those of the scene's other shapes. Kernels that take
a HeldTable's ``places`` take these as well; those that know of clouds find the trees behind them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.query.distance.pair_entry import PAIR_DISTANCE
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.spatial.vectors import rotate
from scene_graph_ros.geometry.tables.held_table import borrowed_table, HeldTable, hold
from scene_graph_ros.geometry.tables.point_tree import borrowed_points, PlacedPoints
from scene_graph_ros.geometry.tables.table_arrays import ShapeTable

__all__ = [
    "ElementTable",
    "first_cloud_of",
    "hold_elements",
    "measure_of",
    "tree_of",
    "with_point",
]

_IS_COMPILED = hasattr(rotate, "py_func")


class ElementTable(NamedTuple):
    """A shape table whose last rows are a point and clouds."""

    held: HeldTable
    clouds: tuple[PlacedPoints, ...]
    point: int
    """The row of a point at its own origin; those of the clouds follow."""


class _TableWithTrees(ShapeTable):
    """A stand-in for the array where nothing is compiled."""

    trees: tuple[Any, ...]


def with_point(table: ShapeTable) -> ShapeTable:
    """Return a table with the row of a point behind its own."""
    return _with_rows(table, np.zeros((1, 3)), np.zeros((1, 3)), np.zeros(1), exact=False)


def hold_elements(table: ShapeTable, clouds: Sequence[PlacedPoints]) -> ElementTable:
    """Return a table of ``with_point`` with rows for clouds, and where all of that is."""
    point = len(table.kind) - 1
    lower, upper = np.zeros((2, len(clouds), 3))
    for k, cloud in enumerate(clouds):
        if cloud.count > 0:
            lower[k] = cloud.tree.bounds[0] - cloud.tree.radius[0]
            upper[k] = cloud.tree.bounds[1] + cloud.tree.radius[0]
    # What a pair's errors are relative to is the size of the element that decides.
    scale = np.array([2.0 * cloud.tree.radius[0] for cloud in clouds])
    whole = _with_rows(table, lower, upper, scale, exact=True)
    if not _IS_COMPILED:
        stand_in = _TableWithTrees(*whole)
        stand_in.trees = tuple(cloud.tree for cloud in clouds)
        return ElementTable(HeldTable(whole, stand_in), tuple(clouds), point)
    held = hold(whole)
    parts = [held.places, *(cloud.places for cloud in clouds)]
    words = len(clouds[0].places) if clouds else 0
    last = np.array([PAIR_DISTANCE.address(), words, len(clouds)], np.int64)
    places = np.concatenate([*parts, last])
    return ElementTable(HeldTable(whole, places), tuple(clouds), point)


def _with_rows(
    table: ShapeTable, lower: Any, upper: Any, scale: Any, *, exact: bool
) -> ShapeTable:
    """Return a table with rows of points behind its own, that have these boxes and scales."""
    count = len(scale)
    kind = np.full(count, int(ShapeKind.SPHERE), np.int32)
    none = np.full(count, -1, np.int32)
    return table._replace(
        kind=np.concatenate([table.kind, kind]),
        size=np.concatenate([table.size, np.zeros((count, 3))]),
        hull=np.concatenate([table.hull, none]),
        surface=np.concatenate([table.surface, none]),
        exact=np.concatenate([table.exact, np.full(count, exact)]),
        lower=np.concatenate([table.lower, lower]),
        upper=np.concatenate([table.upper, upper]),
        scale=np.concatenate([table.scale, scale]),
    )


if _IS_COMPILED:

    @inlined_kernel
    def first_cloud_of(places):
        """Return the row of the first cloud; that of the point is the one before."""
        return len(borrowed_table(places).kind) - places[len(places) - 1]

    @inlined_kernel
    def tree_of(places, cloud):
        """Return the tree of a cloud, counted from 0."""
        words, count = places[len(places) - 2], places[len(places) - 1]
        first = len(places) - 3 - (count - cloud) * words
        return borrowed_points(places[first:])

    @inlined_kernel
    def measure_of(places):
        """Return the address of PAIR_DISTANCE."""
        return places[len(places) - 3]

else:

    def first_cloud_of(places):
        """Return the row of the first cloud; that of the point is the one before."""
        return len(places.kind) - len(places.trees)

    def tree_of(places, cloud):
        """Return the tree of a cloud, counted from 0."""
        return places.trees[cloud]

    def measure_of(places):
        """Return nothing: the function itself is called."""
        return 0
