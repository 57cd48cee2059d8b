"""The shapes of many elements in a snapshot, where they are, and the pairs that they are in."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.broadphase.aabb import world_boxes
from scene_graph_ros.geometry.errors import UnsupportedPairError
from scene_graph_ros.geometry.model.derived import derived, Part
from scene_graph_ros.geometry.model.ids import GeometryId
from scene_graph_ros.geometry.model.layout import role_arrays, RoleArrays
from scene_graph_ros.geometry.model.proximity import shape_table
from scene_graph_ros.geometry.model.roles import Role
from scene_graph_ros.geometry.model.snapshot import Snapshot
from scene_graph_ros.geometry.model.state import GeometryState
from scene_graph_ros.geometry.query.elements.element_places import (
    ElementTable,
    hold_elements,
    OwnRows,
    with_own_rows,
)
from scene_graph_ros.geometry.shapes.height_field import HeightField
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.shapes.point_cloud import PointCloud
from scene_graph_ros.geometry.shapes.voxel_grid import VoxelGrid
from scene_graph_ros.geometry.spatial.pose_kernels import world_poses_of_children
from scene_graph_ros.geometry.spatial.sums import product
from scene_graph_ros.geometry.tables.height_grid import PlacedHeights
from scene_graph_ros.geometry.tables.voxel_bits import PlacedVoxels

__all__ = ["Clouds", "clouds_of", "field_address", "two_fields"]

FloatArray = NDArray[np.float64]


class Clouds(NamedTuple):
    """The k shapes of many elements with the proximity role: clouds, fields, grids, by id."""

    ids: NDArray[np.int64]
    """(k,)"""
    geometry_ids: tuple[GeometryId, ...]
    table: ElementTable
    rows: RoleArrays
    X_WC: FloatArray
    """(k, 4, 4)"""

    def boxes(self) -> tuple[FloatArray, FloatArray]:
        """Return the corners (k, 3) of the boxes in W around each; inside out where nothing is."""
        lower, upper = np.full((2, len(self.ids), 3), np.inf)
        upper = -upper
        for k, bounds in enumerate(self._own_bounds()):
            if bounds is None:
                continue
            X = self.X_WC[k]
            center = product(X[:3, :3], 0.5 * (bounds[0] + bounds[1])) + X[:3, 3]
            half = product(np.abs(X[:3, :3]), 0.5 * (bounds[1] - bounds[0]))
            # The same rounding as that of the scene's other boxes.
            half += 1e-14 * (np.abs(center) + half + np.abs(bounds).max() + np.abs(X[:3, 3]))
            lower[k], upper[k] = center - half, center + half
        return lower, upper

    def _own_bounds(self) -> list[FloatArray | None]:
        """Return the corners (2, 3) of the box around each in its own frame, if it is anything."""
        result: list[FloatArray | None] = []
        for cloud in self.table.clouds:
            radius = cloud.tree.radius[0] * np.array([[-1.0], [1.0]])
            result.append(cloud.tree.bounds + radius if cloud.count else None)
        fields = self.table.fields
        result += [np.stack(each.bounds()) if each.num_elements else None for each in fields]
        return result

    @property
    def num_clouds(self) -> int:
        """How many of them, the first ones, are clouds."""
        return len(self.table.clouds)

    @property
    def num_heights(self) -> int:
        """How many, behind the clouds, are height fields."""
        return len(self.table.fields) - self.table.own.grids

    def near_pairs(self, snapshot: Snapshot, margin: float) -> NDArray[np.int64]:
        """Return (m, 2): clouds and rows of the proximity arrays whose boxes come that near."""
        allowed = _allowed(snapshot.state)
        table = snapshot.proximity.table
        if not len(table.kind):
            return np.empty((0, 2), np.int64)
        allowed = allowed & np.array([[count > 0] for count in self.table.counts])
        if margin == np.inf:
            return np.argwhere(allowed)
        lower, upper = world_boxes(table, snapshot.X_WG)
        is_half_space = table.kind == ShapeKind.HALF_SPACE
        lower[is_half_space], upper[is_half_space] = -np.inf, np.inf
        own_lower, own_upper = (corner[:, np.newaxis] for corner in self.boxes())
        near = (lower <= own_upper + margin) & (upper >= own_lower - margin)
        return np.argwhere(allowed & near.all(axis=2))

    def near_clouds(self, snapshot: Snapshot, margin: float) -> NDArray[np.int64]:
        """Return (m, 2): pairs of clouds and fields, the first one first."""
        lower, upper = self.boxes()
        if margin == np.inf:
            has_points: NDArray[np.bool_] = np.all(np.isfinite(lower), axis=1)
            near = has_points & has_points[:, np.newaxis]
        else:
            below: NDArray[np.bool_] = np.all(lower <= upper[:, np.newaxis] + margin, axis=2)
            near = below & below.T
        pairs = np.argwhere(np.triu(near, 1))
        filtered = snapshot.state.collision_filtered
        ids = self.geometry_ids
        kept = [not filtered(ids[a], ids[b]) for a, b in pairs.tolist()]
        result: NDArray[np.int64] = pairs[np.array(kept, dtype=np.bool_)]
        return result


def clouds_of(snapshot: Snapshot) -> Clouds:
    """Return the clouds and fields of a snapshot, found once."""
    known = snapshot.elements
    if known is None:
        known = snapshot.elements = _find_clouds(snapshot)
    assert isinstance(known, Clouds)
    return known


def _find_clouds(snapshot: Snapshot) -> Clouds:
    state = snapshot.state
    rows = _element_rows(state)
    is_cloud = [isinstance(state.geometries[i].shape, PointCloud) for i in rows.geometry_ids]
    first = sum(is_cloud)
    clouds = [snapshot.point_set(each).placed for each in rows.geometry_ids[:first]]
    fields = [_placed(snapshot, each) for each in rows.geometry_ids[first:]]
    X_WC = np.empty_like(rows.X_FG)
    world_poses_of_children(rows.all_rows, rows.frame, snapshot.X_WF, rows.X_FG, X_WC)
    table = hold_elements(_own_rows(state), clouds, fields, field_address() if fields else 0)
    return Clouds(rows.ids, rows.geometry_ids, table, rows, X_WC)


def _placed(snapshot: Snapshot, geometry_id: GeometryId) -> PlacedHeights | PlacedVoxels:
    if isinstance(snapshot.state.geometries[geometry_id].shape, VoxelGrid):
        return snapshot.voxel_set(geometry_id).placed
    return snapshot.height_set(geometry_id).placed


def two_fields(snapshot: Snapshot, one: GeometryId, other: GeometryId) -> UnsupportedPairError:
    """Return the error for a pair of height fields."""
    names = [snapshot.inspector.get_path(each) for each in sorted((one, other))]
    return UnsupportedPairError(
        f"{names[0]} against {names[1]} has no answer: two height fields are not measured against"
        " each other. Exclude the pair by a collision filter, or register one of them as a Mesh"
        " or VoxelGrid."
    )


def field_address() -> int:
    """Return the address of FIELD_DISTANCE, which is compiled or loaded now."""
    from scene_graph_ros.geometry.query.elements.field_entry import FIELD_DISTANCE

    return FIELD_DISTANCE.address()


@derived(Part.FRAMES, Role.PROXIMITY)
def _element_rows(state: GeometryState) -> RoleArrays:
    records = [state.geometries[i] for i in state.element_ids(Role.PROXIMITY)]
    records.sort(key=lambda record: record.shape.kind)  # stable; the kinds are in this order
    return role_arrays(records, state.layout())


@derived(Role.PROXIMITY)
def _own_rows(state: GeometryState) -> OwnRows:
    shapes = [state.geometries[i].shape for i in state.element_ids(Role.PROXIMITY)]
    has_fields = any(isinstance(shape, HeightField) for shape in shapes)
    edges = [shape.voxel for shape in shapes if isinstance(shape, VoxelGrid)]
    return with_own_rows(shape_table(state), has_fields=has_fields, edges=edges)


@derived(Part.FRAMES, Part.FILTERS, Role.PROXIMITY)
def _allowed(state: GeometryState) -> NDArray[np.bool_]:
    """Return (k, n): the pairs of clouds and rows that collision queries look at."""
    own, others = _element_rows(state), state.role_arrays(Role.PROXIMITY)
    result = own.frame[:, np.newaxis] != others.frame
    excluded = state.filters.is_excluded
    for k, cloud in enumerate(own.geometry_ids):
        for row, other in enumerate(others.geometry_ids):
            if result[k, row] and excluded(cloud, other):
                result[k, row] = False
    return result
