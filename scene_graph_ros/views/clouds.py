"""Drawings of clouds: their balls, which change."""

from __future__ import annotations

from collections.abc import Iterable
import functools

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.model.ids import GeometryId
from scene_graph_ros.geometry.model.inspector import SceneGraphInspector
from scene_graph_ros.geometry.model.point_set import PointSet
from scene_graph_ros.geometry.model.roles import Role
from scene_graph_ros.geometry.model.snapshot import Snapshot
from scene_graph_ros.geometry.shapes.point_cloud import PointCloud
from scene_graph_ros.views.deformables import DeformableItem
from scene_graph_ros.views.items import draw_items

__all__ = [
    "MOST_DRAWN",
    "balls_in_world",
    "cloud_ids",
    "cloud_items",
    "octahedra_in_world",
    "placed_version",
]

MOST_DRAWN = 4096
"""Balls of a cloud that pages show; of more every second, third, ... along a curve through all."""

_CORNERS = np.concatenate([np.eye(3), -np.eye(3)])
_FACES = np.array(
    [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]]
)
_SMALLEST = 0.002
"""Metres. What points without a radius are drawn as."""


def cloud_ids(snapshot: Snapshot, role: Role) -> list[GeometryId]:
    """Return the clouds with a role, sorted."""
    shapes = snapshot.state.geometries
    ids = snapshot.state.element_ids(role)
    return [each for each in ids if isinstance(shapes[each].shape, PointCloud)]


def cloud_items(
    inspector: SceneGraphInspector, role: Role, geometry_ids: Iterable[GeometryId]
) -> list[DeformableItem]:
    """Return the drawings of clouds with ``role``: triangles of ``octahedra_in_world``."""
    items = draw_items(inspector, role, geometry_ids)
    return [DeformableItem(item, _triangles()) for item in items]


@functools.cache
def _triangles() -> NDArray[np.int64]:
    """Return those of as many octahedra as there may be; spare ones have no size."""
    first = 6 * np.arange(MOST_DRAWN)[:, np.newaxis, np.newaxis]
    result: NDArray[np.int64] = (_FACES + first).reshape(-1, 3)
    return result


def octahedra_in_world(snapshot: Snapshot, geometry_id: GeometryId) -> NDArray[np.float64]:
    """Return the corners ``(6 MOST_DRAWN, 3)`` in W, in m, of octahedra in balls of a cloud."""
    points, X_WG = snapshot.point_set(geometry_id), snapshot.pose_in_world(geometry_id)
    result = np.tile(X_WG[:3, 3], (MOST_DRAWN, 6, 1))
    if points.count:
        tree = points.placed.tree
        step = -(-points.count // MOST_DRAWN)
        places = np.arange(0, points.count, step)
        leaf, lane = np.divmod(places, tree.points.shape[2])
        centers = tree.points[leaf, :, lane] @ X_WG[:3, :3].T + X_WG[:3, 3]
        radii = tree.radii[leaf, lane] if len(tree.radii) else np.full(len(places), tree.radius[1])
        sizes = np.maximum(radii, _SMALLEST)[:, np.newaxis, np.newaxis]
        result[: len(places)] = centers[:, np.newaxis] + sizes * _CORNERS
        result[len(places) :] = centers[0]
    return result.reshape(-1, 3)


def balls_in_world(snapshot: Snapshot, geometry_id: GeometryId) -> list[NDArray[np.float64]]:
    """Return the centres ``(n, 3)`` of a cloud's balls in W, in m, in a list."""
    X_WG = snapshot.pose_in_world(geometry_id)
    return [snapshot.point_set(geometry_id).points @ X_WG[:3, :3].T + X_WG[:3, 3]]


def placed_version(snapshot: Snapshot, geometry_id: GeometryId) -> tuple[PointSet, bytes]:
    """Return a value that differs where the balls differ, or are elsewhere."""
    return snapshot.point_set(geometry_id), snapshot.pose_in_world(geometry_id).tobytes()
