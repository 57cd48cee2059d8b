"""The shapes that a checker's kernels read: those of the scene's table, and elements behind."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.model.ids import GeometryId
from scene_graph_ros.geometry.model.snapshot import Snapshot
from scene_graph_ros.geometry.query.candidates.rows import candidate_rows
from scene_graph_ros.geometry.query.distance.driver import solve_pairs, WITHIN
from scene_graph_ros.geometry.tables.held_table import HeldTable, hold
from scene_graph_ros.geometry.tables.table_arrays import ShapeTable
from scene_graph_ros.planning.pairs.pair_measure import measure_address

__all__ = ["CheckedShapes", "checked_shapes"]


class CheckedShapes(NamedTuple):
    """Shapes of a scene at one moment.

    Rows of clouds and of height fields come last, after some that are no geometries.
    """

    held: HeldTable
    measure: int
    """The address of what measures pairs of them."""
    rows: NDArray[np.int64]
    """``(b,)``: their rows in the table, by ascending id."""
    geometry_ids: tuple[GeometryId, ...]
    """``(b,)``."""
    frame: NDArray[np.int64]
    """By row: the frame, as a row of the scene's arrays of frames."""
    X_FG: NDArray[np.float64]
    """By row."""
    X_WG: NDArray[np.float64]
    """By row."""
    clouds: tuple[Any, ...] = ()
    """PlacedPoints of the table's last rows but the fields'."""
    fields: tuple[Any, ...] = ()
    """PlacedHeights, then PlacedVoxels, of the table's last rows."""

    @property
    def has_elements(self) -> bool:
        """Whether there are clouds or height fields."""
        return bool(self.clouds or self.fields)

    @property
    def first_element(self) -> int:
        """The row of the first cloud, or field."""
        return len(self.table.kind) - len(self.clouds) - len(self.fields)

    @property
    def own_held(self) -> HeldTable:
        """The table for one thread at a time: the places of fields have a slot for its prisms."""
        if not self.fields:
            return self.held
        from scene_graph_ros.geometry.query.elements.element_places import with_slot

        return with_slot(self.held)

    @property
    def table(self) -> ShapeTable:
        """The table."""
        return self.held.table

    def ranks(self) -> NDArray[np.int64]:
        """Return the rank of each row in the order of ids."""
        result = np.zeros(len(self.table.kind), np.int64)
        result[self.rows] = np.arange(len(self.rows))
        return result

    def possible_pairs(self, snapshot: Snapshot) -> NDArray[np.int64]:
        """Return the rows ``(p, 2)`` of all pairs that the scene's filters leave.

        Raises UnsupportedPairError for two height fields.
        """
        pairs = candidate_rows(snapshot, np.inf)
        if not self.has_elements:
            return pairs
        from scene_graph_ros.geometry.tables.height_grid import PlacedHeights

        known = set(map(tuple, pairs.tolist()))
        filtered, first = snapshot.state.collision_filtered, self.first_element
        first_field = len(self.table.kind) - len(self.fields)
        first_grid = first_field + sum(isinstance(f, PlacedHeights) for f in self.fields)
        for k, row in enumerate(self.rows.tolist()):
            for m, other in enumerate(self.rows.tolist()):
                if row >= first and (other < first or m < k):
                    ids = self.geometry_ids[k], self.geometry_ids[m]
                    if filtered(*ids):
                        continue
                    if first_field <= min(row, other) and max(row, other) < first_grid:
                        from scene_graph_ros.geometry.query.elements.scene import two_fields

                        raise two_fields(snapshot, *ids)
                    known.add((row, other))
        return np.array(sorted(known), np.int64).reshape(-1, 2)

    def solve(
        self, X_WG: NDArray[np.float64], pairs: NDArray[np.int64], max_distance: float
    ) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Return rows ``(k, 2)`` and distances of those pairs that are within a distance (m).

        ``X_WG`` is by row.
        """
        if not self.has_elements:
            solved = solve_pairs(self.held, X_WG, pairs, max_distance, WITHIN)
            return solved.rows, solved.distance
        from scene_graph_ros.planning.pairs.measured_pairs import measure_pairs

        distances = np.empty(len(pairs))
        held = self.own_held.places
        measure_pairs(held, self.measure, X_WG, pairs, max_distance, distances)
        kept = distances <= max_distance
        return pairs[kept], distances[kept]

    def again(self) -> CheckedShapes:
        """Return the same with addresses of this process, into which it was unpickled."""
        if not self.has_elements:
            return self._replace(held=hold(self.table), measure=measure_address(has_clouds=False))
        from scene_graph_ros.geometry.query.elements.element_places import hold_elements, OwnRows
        from scene_graph_ros.geometry.query.elements.scene import field_address
        from scene_graph_ros.geometry.tables.height_grid import grid_heights_again
        from scene_graph_ros.geometry.tables.point_tree import held_again
        from scene_graph_ros.geometry.tables.prism_slots import SLOTS
        from scene_graph_ros.geometry.tables.voxel_bits import PlacedVoxels, voxels_again

        clouds, fields = (
            tuple(map(held_again, self.clouds)),
            tuple(
                voxels_again(each) if isinstance(each, PlacedVoxels) else grid_heights_again(each)
                for each in self.fields
            ),
        )
        first = self.first_element
        columns = ("kind", "size", "hull", "surface", "exact", "lower", "upper", "scale")
        own = self.table._replace(**{name: getattr(self.table, name)[:first] for name in columns})
        grids = sum(isinstance(each, PlacedVoxels) for each in fields)
        rows = OwnRows(own, SLOTS if len(fields) > grids else 0, grids)
        held = hold_elements(rows, clouds, fields, field_address() if fields else 0).held
        return self._replace(
            held=held, measure=measure_address(has_clouds=True), clouds=clouds, fields=fields
        )

    def packed(self) -> CheckedShapes:
        """Return the same without addresses, to be pickled."""
        clouds = tuple(cloud._replace(places=None) for cloud in self.clouds)
        fields = tuple(field._replace(places=None) for field in self.fields)
        return self._replace(
            held=HeldTable(self.table, None), measure=0, clouds=clouds, fields=fields
        )


def checked_shapes(snapshot: Snapshot) -> CheckedShapes:
    """Return all shapes with the proximity role but deformable ones."""
    proximity = snapshot.proximity
    count = len(proximity.ids)
    if not proximity.has_elements:
        return CheckedShapes(
            proximity.held,
            measure_address(has_clouds=False),
            np.arange(count),
            proximity.geometry_ids,
            proximity.frame.astype(np.int64),
            proximity.X_FG,
            snapshot.X_WG,
        )
    from scene_graph_ros.geometry.query.elements.scene import clouds_of

    clouds = clouds_of(snapshot)
    ids = np.concatenate([proximity.ids, clouds.ids])
    first = clouds.table.point + 1
    rows = np.concatenate([np.arange(count), np.arange(first, first + len(clouds.ids))])
    order = np.argsort(ids, kind="stable")
    every = (*proximity.geometry_ids, *clouds.geometry_ids)
    spare = first - count  # rows that are no geometries
    none = np.tile(np.eye(4), (spare, 1, 1))
    return CheckedShapes(
        clouds.table.held,
        measure_address(has_clouds=True),
        rows[order],
        tuple(every[k] for k in order.tolist()),
        np.concatenate([proximity.frame, spare * [0], clouds.rows.frame]).astype(np.int64),
        np.concatenate([proximity.X_FG, none, clouds.rows.X_FG]),
        np.concatenate([snapshot.X_WG, none, clouds.X_WC]),
        clouds.table.clouds,
        clouds.table.fields,
    )
