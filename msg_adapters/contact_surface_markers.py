"""Contact surfaces to look at: triangles coloured by pressure, see ``views.surfaces``.

The namespace of the markers says the scale: viewers show it beside the markers.
"""

from __future__ import annotations

from typing import Any

from geometry_msgs.msg import Point, Vector3
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from msg_adapters.poses import header_to_msg
from msg_adapters.stamps import stamp_to_msg
from scene_graph_ros.views.surfaces import colored_corners

__all__ = [
    "contact_surface_markers_to_msg",
    "deletion_marker",
    "pressure_namespace",
    "triangle_marker",
]

_PREFIXES = ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""))


def pressure_namespace(scale: float) -> str:
    """Return the namespace of markers with this scale: ``pressure 0 (blue) to 20 kPa (red)``."""
    factor, prefix = next((p for p in _PREFIXES if scale >= p[0]), _PREFIXES[-1])
    return f"pressure 0 (blue) to {scale / factor:g} {prefix}Pa (red)"


def triangle_marker(scale: float, frame_id: str) -> Marker:
    """Return the marker of a scale, without corners."""
    marker = Marker(ns=pressure_namespace(scale), type=Marker.TRIANGLE_LIST, action=Marker.ADD)
    marker.header.frame_id = frame_id
    marker.pose.orientation.w = 1.0
    marker.scale = Vector3(x=1.0, y=1.0, z=1.0)
    # What viewers use where they don't use the colours of corners.
    marker.color = ColorRGBA(r=0.0, g=1.0, b=0.0, a=1.0)
    return marker


def deletion_marker(scale: float, frame_id: str, stamp_ns: int) -> Marker:
    """Return the deletion of the marker of a scale."""
    return Marker(
        header=header_to_msg(stamp_ns, frame_id),
        ns=pressure_namespace(scale),
        action=Marker.DELETE,
    )


def contact_surface_markers_to_msg(
    surfaces: Any, *, scale: float, stamp_ns: int, frame_id: str
) -> MarkerArray:
    """Return one marker with the triangles of all surfaces; without any, its deletion."""
    if not len(surfaces):
        return MarkerArray(markers=[deletion_marker(scale, frame_id, stamp_ns)])
    marker = triangle_marker(scale, frame_id)
    marker.header.stamp = stamp_to_msg(stamp_ns)
    corners, colors = colored_corners(surfaces, scale)
    marker.points = [Point(x=x, y=y, z=z) for x, y, z in corners.tolist()]
    marker.colors = [ColorRGBA(r=r, g=g, b=b, a=a) for r, g, b, a in colors.tolist()]
    return MarkerArray(markers=[marker])
