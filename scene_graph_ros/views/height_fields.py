"""Drawings of height fields and voxel grids: their surfaces, which change."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.model.height_set import HeightSet
from scene_graph_ros.geometry.model.ids import GeometryId
from scene_graph_ros.geometry.model.inspector import SceneGraphInspector
from scene_graph_ros.geometry.model.roles import Role
from scene_graph_ros.geometry.model.snapshot import Snapshot
from scene_graph_ros.geometry.model.voxel_set import VoxelSet
from scene_graph_ros.geometry.shapes.field_surface import (
    drawn_places,
    field_triangles,
    field_vertices,
)
from scene_graph_ros.geometry.shapes.height_field import HeightField
from scene_graph_ros.geometry.shapes.voxel_grid import VoxelGrid
from scene_graph_ros.views.deformables import DeformableItem
from scene_graph_ros.views.items import draw_items
from scene_graph_ros.views.voxel_grids import box_corners, box_triangles

__all__ = ["MOST_ROWS", "field_ids", "field_items", "placed_heights", "surface_in_world"]

MOST_ROWS = 128
"""Rows, and columns, of heights that are drawn: of more every second, third, ..."""


def field_ids(snapshot: Snapshot, role: Role) -> list[GeometryId]:
    """Return the height fields and voxel grids with a role, sorted."""
    shapes = snapshot.state.geometries
    ids = snapshot.state.element_ids(role)
    return [each for each in ids if isinstance(shapes[each].shape, HeightField | VoxelGrid)]


def field_items(
    inspector: SceneGraphInspector, role: Role, geometry_ids: Iterable[GeometryId]
) -> list[DeformableItem]:
    """Return the drawings of height fields with ``role``."""
    items = draw_items(inspector, role, geometry_ids)
    return [DeformableItem(item, _triangles(item.shape)) for item in items]


def _triangles(shape: object) -> NDArray[np.int64]:
    if isinstance(shape, VoxelGrid):
        return box_triangles()
    assert isinstance(shape, HeightField)
    return field_triangles(drawn_places(shape, MOST_ROWS))


def surface_in_world(snapshot: Snapshot, geometry_id: GeometryId) -> NDArray[np.float64]:
    """Return the corners ``(v, 3)`` in W, in m, of a field's triangles."""
    now, X_WG = snapshot.element_set(geometry_id), snapshot.pose_in_world(geometry_id)
    if isinstance(now, VoxelSet):
        corners = box_corners(now)
    else:
        assert isinstance(now, HeightSet)
        corners = field_vertices(now.shape, now.heights, drawn_places(now.shape, MOST_ROWS))
    result: NDArray[np.float64] = corners @ X_WG[:3, :3].T + X_WG[:3, 3]
    return result


def placed_heights(snapshot: Snapshot, geometry_id: GeometryId) -> tuple[object, bytes]:
    """Return a value that differs where the heights or voxels differ, or are elsewhere."""
    return snapshot.element_set(geometry_id), snapshot.pose_in_world(geometry_id).tobytes()
