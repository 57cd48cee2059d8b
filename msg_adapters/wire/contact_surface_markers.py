"""The triangles of contact surfaces as bytes; see ``contact_surface_markers``."""

from __future__ import annotations

from typing import Any

from visualization_msgs.msg import MarkerArray

from msg_adapters.contact_surface_markers import deletion_marker, triangle_marker
from msg_adapters.wire.fields import Serializer
from msg_adapters.wire.triangles import TriangleListWire
from scene_graph_ros.views.surfaces import colored_corners

__all__ = ["ContactSurfaceMarkerWire"]


class ContactSurfaceMarkerWire:
    """Serializes the marker as ``contact_surface_markers_to_msg`` and the serializer do."""

    def __init__(self, frame_id: str, serialize: Serializer) -> None:
        self._frame_id = frame_id
        self._serialize = serialize
        self._scale: float | None = None
        self._former: float | None = None
        self._wire: TriangleListWire | None = None

    def message(self, surfaces: Any, *, scale: float, stamp_ns: int) -> bytes:
        """Return the bytes of the marker; after a change of scale, also the former's deletion."""
        if scale != self._scale:
            self._former, self._scale, self._wire = self._scale, scale, None
        before = []
        if self._former is not None:
            before.append(deletion_marker(self._former, self._frame_id, stamp_ns))
            self._former = None
        if not len(surfaces):
            deletion = deletion_marker(scale, self._frame_id, stamp_ns)
            return self._serialize(MarkerArray(markers=[*before, deletion]))
        if self._wire is None:
            marker = triangle_marker(scale, self._frame_id)
            self._wire = TriangleListWire(
                self._serialize, marker, has_colors=True, is_whole=True
            )  # fmt: skip
        corners, colors = colored_corners(surfaces, scale)
        return self._wire.data(
            corners, stamp_ns, colors=colors, before=before, key=len(before)
        )  # fmt: skip
