"""Markers of deformable geometries: their driven meshes as triangles in the world."""

from __future__ import annotations

from geometry_msgs.msg import Point, Vector3
import numpy as np
from numpy.typing import NDArray
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker

from msg_adapters.marker_rows import marker_id
from msg_adapters.stamps import stamp_to_msg
from scene_graph_ros.views.deformables import DeformableItem
from scene_graph_ros.views.draw_list import DrawItem
from scene_graph_ros.views.items import DEFAULT_COLOR

__all__ = ["deformable_marker_to_msg", "empty_marker"]


def empty_marker(item: DrawItem, frame_id: str) -> Marker:
    """Return the marker of a deformable geometry, without corners."""
    marker = Marker(
        ns=item.group, id=marker_id(item.geometry_id), type=Marker.TRIANGLE_LIST, action=Marker.ADD
    )
    marker.header.frame_id = frame_id
    marker.pose.orientation.w = 1.0
    marker.scale = Vector3(x=1.0, y=1.0, z=1.0)
    color = item.rgba or DEFAULT_COLOR
    marker.color = ColorRGBA(r=color.r, g=color.g, b=color.b, a=color.a)
    return marker


def deformable_marker_to_msg(
    item: DeformableItem, p_WVs: NDArray[np.float64], *, stamp_ns: int, frame_id: str
) -> Marker:
    """Return the marker of a deformable geometry whose driven mesh has vertices ``(n, 3)``."""
    marker = empty_marker(item.item, frame_id)
    marker.header.stamp = stamp_to_msg(stamp_ns)
    corners = p_WVs[item.triangles.ravel()]
    marker.points = [Point(x=x, y=y, z=z) for x, y, z in corners.tolist()]
    return marker
