"""Boxes around geometries in the world."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.broadphase.aabb import world_boxes
from scene_graph_ros.geometry.errors import RoleError
from scene_graph_ros.geometry.model.ids import GeometryId
from scene_graph_ros.geometry.model.point_set import PointSet
from scene_graph_ros.geometry.model.snapshot import Snapshot
from scene_graph_ros.geometry.query.memo import Memo
from scene_graph_ros.geometry.shapes.element_shape import ElementShape
from scene_graph_ros.geometry.shapes.half_space import HalfSpace
from scene_graph_ros.geometry.shapes.point_cloud import PointCloud
from scene_graph_ros.geometry.spatial.sums import moved, product

__all__ = ["compute_aabb_in_world"]

Box = tuple[NDArray[np.float64], NDArray[np.float64]]


def compute_aabb_in_world(memo: Memo, geometry_id: GeometryId) -> Box | None:
    """Answer `QueryObject.compute_aabb_in_world`."""
    snapshot = memo.snapshot
    inspector = snapshot.inspector
    if inspector.is_deformable(geometry_id):
        points = snapshot.configuration(geometry_id).q_WG
        return points.min(axis=0), points.max(axis=0)
    if inspector.get_proximity_properties(geometry_id) is None:
        name = inspector.get_name(geometry_id)
        raise RoleError(f"geometry {name!r} ({geometry_id!r}) has no proximity role")
    shape = inspector.get_shape(geometry_id)
    if isinstance(shape, HalfSpace):
        return None
    if isinstance(shape, PointCloud):
        return _box_of_cloud(snapshot, geometry_id)
    if isinstance(shape, ElementShape):
        return _box_of_grid(snapshot, geometry_id)
    lower, upper = memo.get("boxes in the world", _boxes)
    row = int(np.searchsorted(snapshot.proximity.ids, int(geometry_id)))
    return lower[row].copy(), upper[row].copy()


def _box_of_grid(snapshot: Snapshot, geometry_id: GeometryId) -> Box | None:
    """Return the box around that of a height field or voxel grid, None where nothing is solid."""
    now = snapshot.element_set(geometry_id)
    assert not isinstance(now, PointSet)
    placed = now.placed
    if not placed.num_elements:
        return None
    lower, upper = placed.bounds()
    X_WG = snapshot.pose_in_world(geometry_id)
    center = moved(0.5 * (lower + upper)[np.newaxis], X_WG)[0]
    half = product(np.abs(X_WG[:3, :3]), 0.5 * (upper - lower))
    return center - half, center + half


def _boxes(snapshot: Snapshot) -> Box:
    return world_boxes(snapshot.proximity.table, snapshot.X_WG)


def _box_of_cloud(snapshot: Snapshot, geometry_id: GeometryId) -> Box | None:
    cloud = snapshot.point_set(geometry_id)
    if not cloud.count:
        return None
    X_WG, p = snapshot.pose_in_world(geometry_id), cloud.points
    # Column by column, so that the sum has one order.
    p_W = X_WG[:3, 3] + (p[:, :1] * X_WG[:3, 0] + p[:, 1:2] * X_WG[:3, 1] + p[:, 2:] * X_WG[:3, 2])
    radii = np.broadcast_to(cloud.radii, len(p))[:, np.newaxis]
    return (p_W - radii).min(axis=0), (p_W + radii).max(axis=0)
