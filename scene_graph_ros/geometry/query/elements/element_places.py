"""A scene's shape table with rows for elements, and where their trees are, as one array.

Rows for prisms of height fields (``tables.prism_slots``), for a voxel of each grid, for a point,
for clouds, for height fields and for voxel grids follow those of the scene's other shapes. Fields
and grids are counted together, as what has cells. Kernels that take a HeldTable's ``places`` take
these as well; those that know of elements find the trees and grids behind them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple
import weakref

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.query.distance.pair_entry import PAIR_DISTANCE
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.spatial.vectors import rotate
from scene_graph_ros.geometry.tables.height_grid import borrowed_heights, PlacedHeights
from scene_graph_ros.geometry.tables.held_table import borrowed_table, HeldTable, hold
from scene_graph_ros.geometry.tables.point_tree import borrowed_points, PlacedPoints
from scene_graph_ros.geometry.tables.prism_slots import (
    leave_slot,
    SLOTS,
    take_slot,
    with_slots,
)
from scene_graph_ros.geometry.tables.table_arrays import ShapeTable
from scene_graph_ros.geometry.tables.voxel_bits import borrowed_voxels, PlacedVoxels

__all__ = [
    "ElementTable",
    "OwnRows",
    "cell_row_of",
    "field_measure_of",
    "first_element_of",
    "first_field_of",
    "grid_of",
    "hold_elements",
    "is_of_voxels",
    "measure_of",
    "point_row_of",
    "prism_row_of",
    "tree_of",
    "voxels_of",
    "with_own_rows",
    "with_slot",
]

_IS_COMPILED = hasattr(rotate, "py_func")


class OwnRows(NamedTuple):
    """A shape table with rows for prisms, if it is for height fields, and a point."""

    table: ShapeTable
    slots: int
    """Rows of prisms; those of voxels follow the last."""
    grids: int = 0
    """Rows of voxels, one for each grid; that of the point follows the last."""


class ElementTable(NamedTuple):
    """A shape table whose last rows are prisms, voxels, a point, and shapes of many elements."""

    held: HeldTable
    """For questions about no height field: it has no slot for a prism."""
    own: OwnRows
    clouds: tuple[PlacedPoints, ...]
    fields: tuple[PlacedHeights | PlacedVoxels, ...]
    """Height fields, then voxel grids."""
    point: int
    """The row of a point at its own origin; those of the clouds, then of the fields follow."""

    @property
    def counts(self) -> list[int]:
        """How many elements the clouds and fields have."""
        return [cloud.count for cloud in self.clouds] + [each.num_elements for each in self.fields]

    def own_places(self) -> Any:
        """Return the table's places for one thread at a time; see ``with_slot``."""
        return with_slot(self.held).places if self.fields else self.held.places


class _Lease:
    """Lives as long as a stand-in that has it: no tuple tells when it is gone."""


class _TableWithTrees(ShapeTable):
    """A stand-in for the array where nothing is compiled."""

    lease: _Lease

    trees: tuple[Any, ...]
    grids: tuple[Any, ...]
    voxels: int
    slots: int
    slot: int


def with_own_rows(table: ShapeTable, *, has_fields: bool, edges: Sequence[float]) -> OwnRows:
    """Return a table with rows for prisms, if there are height fields, for voxels and a point.

    ``edges`` (m) are those of the voxel grids.
    """
    slots = SLOTS if has_fields else 0
    if has_fields:
        table = with_slots(table, slots)
    halves = 0.5 * np.array(edges).reshape(-1, 1) * np.ones(3)
    table = _with_rows(table, -halves, halves, 2.0 * halves[:, 0], exact=False)
    rows = slice(len(table.kind) - len(edges), None)
    table.kind[rows], table.size[rows] = int(ShapeKind.BOX), halves
    one = _with_rows(table, np.zeros((1, 3)), np.zeros((1, 3)), np.zeros(1), exact=False)
    return OwnRows(one, slots, len(edges))


def with_slot(held: HeldTable) -> HeldTable:
    """Return the same table with places that have a slot for prisms as long as they live.

    They are for one thread at a time. Raises RuntimeError where all slots are taken.
    """
    slot = take_slot()
    if _IS_COMPILED:
        places = held.places.copy()
        places[-_SLOT] = slot
    else:
        known = held.places
        places = _stand_in(held.table, known.trees, known.grids, known.slots, known.voxels)
        places.slot, places.lease = slot, _Lease()
    weakref.finalize(places if _IS_COMPILED else places.lease, leave_slot, slot)
    return HeldTable(held.table, places)


def hold_elements(
    own: OwnRows,
    clouds: Sequence[PlacedPoints],
    fields: Sequence[PlacedHeights | PlacedVoxels],
    field_measure: int,
) -> ElementTable:
    """Return a table of ``with_own_rows`` with rows for elements, and where all of that is.

    ``field_measure`` is the address of FIELD_DISTANCE, where there are fields.
    """
    point, count = len(own.table.kind) - 1, len(clouds) + len(fields)
    lower, upper = np.zeros((2, count, 3))
    for k, cloud in enumerate(clouds):
        if cloud.count > 0:
            lower[k] = cloud.tree.bounds[0] - cloud.tree.radius[0]
            upper[k] = cloud.tree.bounds[1] + cloud.tree.radius[0]
    for k, field in enumerate(fields, len(clouds)):
        lower[k], upper[k] = field.bounds()
    # What a pair's errors are relative to is the size of the element that decides.
    of_fields = [_scale_of(field) for field in fields]
    scale = np.array([2.0 * cloud.tree.radius[0] for cloud in clouds] + of_fields)
    whole = _with_rows(own.table, lower, upper, scale, exact=True)
    if _IS_COMPILED:
        places = _places(whole, own, clouds, fields, field_measure)
    else:
        trees = tuple(cloud.tree for cloud in clouds)
        grids = tuple(
            each.bits if isinstance(each, PlacedVoxels) else each.grid for each in fields
        )
        places = _stand_in(whole, trees, grids, own.slots, own.grids)
    return ElementTable(HeldTable(whole, places), own, tuple(clouds), tuple(fields), point)


def _scale_of(field: PlacedHeights | PlacedVoxels) -> float:
    """Return the size of an element, m."""
    if isinstance(field, PlacedVoxels):
        return float(field.bits.numbers[0])
    lower, upper = field.bounds()
    return float(upper[2] - lower[2])


def _stand_in(table: ShapeTable, trees: Any, grids: Any, slots: int, voxels: int) -> Any:
    result = _TableWithTrees(*table)
    result.trees, result.grids, result.voxels = trees, grids, voxels
    result.slots, result.slot = slots, -1
    return result


_LAST = 10
_SLOT = 10
"""Numbers at the end, and which of these, from there, is the slot. Before it are the trees and the
grids; after it how many slots there are, how many words each voxel grid takes, how many of them
there are, how many words each grid of heights and each tree takes, how many fields, with the voxel
grids, and clouds there are, and the addresses that measure fields and pairs."""


def _places(
    table: ShapeTable,
    own: OwnRows,
    clouds: Sequence[PlacedPoints],
    fields: Sequence[PlacedHeights | PlacedVoxels],
    field_measure: int,
) -> Any:
    last = [
        -1,
        own.slots,
        len(fields[-1].places) if own.grids else 0,
        own.grids,
        len(fields[0].places) if len(fields) > own.grids else 0,
        len(clouds[0].places) if clouds else 0,
        len(fields),
        len(clouds),
        field_measure,
        PAIR_DISTANCE.address(),
    ]
    each = [cloud.places for cloud in clouds] + [field.places for field in fields]
    return np.concatenate([hold(table).places, *each, np.array(last, np.int64)])


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
    def first_element_of(places):
        """Return the row of the first cloud or field; that of the point is the one before."""
        end = len(places)
        return len(borrowed_table(places).kind) - places[end - 4] - places[end - 3]

    @inlined_kernel
    def first_field_of(places):
        """Return the row of the first field."""
        return len(borrowed_table(places).kind) - places[len(places) - 4]

    @inlined_kernel
    def tree_of(places, cloud):
        """Return the tree of a cloud, counted from 0."""
        end = len(places)
        heights = places[end - 4] - places[end - 7]
        behind = _LAST + places[end - 7] * places[end - 8] + heights * places[end - 6]
        return borrowed_points(
            places[end - behind - (places[end - 3] - cloud) * places[end - 5] :]
        )

    @inlined_kernel
    def grid_of(places, field):
        """Return the heights of a field, counted from 0."""
        end = len(places)
        behind = _LAST + places[end - 7] * places[end - 8]
        count = places[end - 4] - places[end - 7]
        return borrowed_heights(places[end - behind - (count - field) * places[end - 6] :])

    @inlined_kernel
    def is_of_voxels(places, field):
        """Return True for a field that is a grid of voxels."""
        end = len(places)
        return field >= places[end - 4] - places[end - 7]

    @inlined_kernel
    def voxels_of(places, field):
        """Return the bits of a field of voxels, counted from 0 among all fields."""
        end = len(places)
        return borrowed_voxels(places[end - _LAST - (places[end - 4] - field) * places[end - 8] :])

    @inlined_kernel
    def cell_row_of(places, field):
        """Return the row of a voxel of a field."""
        return first_element_of(places) - 1 - (places[len(places) - 4] - field)

    @inlined_kernel
    def prism_row_of(places):
        """Return the row that is this thread's for a prism."""
        end = len(places)
        behind = 1 + places[end - 7] + places[end - 9]
        return first_element_of(places) - behind + places[end - _SLOT]

    @inlined_kernel
    def measure_of(places):
        """Return the address of PAIR_DISTANCE."""
        return places[len(places) - 1]

    @inlined_kernel
    def field_measure_of(places):
        """Return the address of FIELD_DISTANCE."""
        return places[len(places) - 2]

else:

    def first_element_of(places):
        """Return the row of the first cloud or field; that of the point is the one before."""
        return len(places.kind) - len(places.trees) - len(places.grids)

    def first_field_of(places):
        """Return the row of the first field."""
        return len(places.kind) - len(places.grids)

    def tree_of(places, cloud):
        """Return the tree of a cloud, counted from 0."""
        return places.trees[cloud]

    def grid_of(places, field):
        """Return the heights of a field, counted from 0."""
        return places.grids[field]

    def is_of_voxels(places, field):
        """Return True for a field that is a grid of voxels."""
        return field >= len(places.grids) - places.voxels

    def voxels_of(places, field):
        """Return the bits of a field of voxels, counted from 0 among all fields."""
        return places.grids[field]

    def cell_row_of(places, field):
        """Return the row of a voxel of a field."""
        return first_element_of(places) - 1 - (len(places.grids) - field)

    def prism_row_of(places):
        """Return the row that is this thread's for a prism."""
        return first_element_of(places) - 1 - places.voxels - places.slots + places.slot

    def measure_of(places):
        """Return nothing: the function itself is called."""
        return 0

    def field_measure_of(places):
        """Return nothing: who is called is the function itself."""
        return 0


@inlined_kernel
def point_row_of(places):
    """Return the row of a point."""
    return first_element_of(places) - 1
