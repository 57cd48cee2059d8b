"""Markers of clouds as bytes: a list of spheres, or of points, for each."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from visualization_msgs.msg import Marker

from msg_adapters.deformable_markers import empty_marker
from msg_adapters.markers import SMALLEST_SIZE
from msg_adapters.wire.deformable_markers import DeformableMarkers
from scene_graph_ros.geometry.shapes.point_cloud import PointCloud
from scene_graph_ros.views.deformables import DeformableItem

__all__ = ["POINT_SIZE", "CloudMarkers"]

POINT_SIZE = 0.005
"""Metres. What points without a radius are drawn as."""


class CloudMarkers(DeformableMarkers):
    """The markers of one role's clouds, put behind those of other geometries.

    A list has one size for all: that of the shape's largest radius.
    """

    def _empty_marker(self, item: DeformableItem) -> Marker:
        marker = empty_marker(item.item, self._frame_id)
        shape = item.item.shape
        assert isinstance(shape, PointCloud)
        radius = float(np.max(shape.radius, initial=0.0))
        marker.type = Marker.SPHERE_LIST if radius > 0.0 else Marker.POINTS
        size = max(2.0 * radius, SMALLEST_SIZE) if radius > 0.0 else POINT_SIZE
        marker.scale.x = marker.scale.y = marker.scale.z = size
        return marker

    def _corners(self, item: DeformableItem, p_WVs: NDArray[np.float64]) -> NDArray[np.float64]:
        return p_WVs
