"""Markers of deformable geometries: their driven meshes as triangles in the world."""

from __future__ import annotations

from typing import NamedTuple

from geometry_msgs.msg import Point, Vector3
import numpy as np
from numpy.typing import NDArray
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker

from msg_adapters.markers import marker_id, MarkerItem
from msg_adapters.stamps import stamp_to_msg
from scene_graph_ros.geometry.model.rgba import Rgba

__all__ = ["DeformableItem", "deformable_marker_to_msg", "empty_marker"]

_DEFAULT = Rgba(0.7, 0.7, 0.7, 1.0)
"""Of what has no colour."""


class DeformableItem(NamedTuple):
    """A deformable geometry to draw."""

    item: MarkerItem
    triangles: NDArray[np.int64]
    """(t, 3) of its driven mesh."""


def empty_marker(item: MarkerItem, frame_id: str) -> Marker:
    """Return the marker of a deformable geometry, without corners."""
    marker = Marker(
        ns=item.ns, id=marker_id(item.geometry_id), type=Marker.TRIANGLE_LIST, action=Marker.ADD
    )
    marker.header.frame_id = frame_id
    marker.pose.orientation.w = 1.0
    marker.scale = Vector3(x=1.0, y=1.0, z=1.0)
    color = item.rgba or _DEFAULT
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
