"""Contact surfaces: an answer for `~/contacts`, shown as triangles, and as a cloud of faces.

Imported, and its bodies built, only while the scene has compliant geometry.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rclpy.serialization import serialize_message
from sensor_msgs.msg import PointCloud2
from visualization_msgs.msg import MarkerArray

from msg_adapters.contact_surfaces import face_points_to_msg
from msg_adapters.wire.contact_surface_markers import ContactSurfaceMarkerWire
from scene_graph_ros.geometry.query.query_object import QueryObject
from scene_graph_ros.geometry.query.representation import ContactRepresentation
from scene_graph_ros.node.effects.effect import Host, Outlet
from scene_graph_ros.node.runtime.made_once import made_once
from scene_graph_ros.node.runtime.names import CONTACT_SURFACE_MARKERS, CONTACT_SURFACE_POINTS
from scene_graph_ros.node.runtime.qos import contact_qos, marker_qos
from scene_graph_ros.node.world.world import WorldSnapshot

__all__ = ["ContactSurfaces", "ContactSurfacesEffect"]


class ContactSurfaces:
    """The surfaces, and the penetrations of the pairs that have none.

    Faces are polygons: there are fewer of them than triangles.
    """

    def __call__(self, snapshot: WorldSnapshot) -> tuple[Any, Any]:
        """Return both tables."""
        question = QueryObject.compute_contact_surfaces_with_fallback
        answer: tuple[Any, Any] = snapshot.ask(question, ContactRepresentation.POLYGON)
        return answer

    def counters(self, answer: tuple[Any, Any] | None) -> Mapping[str, Any]:
        """Return the numbers of surfaces and faces."""
        surfaces: Any = () if answer is None else answer[0]
        faces = len(surfaces.face_areas) if len(surfaces) else 0
        return {"surfaces": len(surfaces), "faces": faces}


class ContactSurfacesEffect:
    """Publishes markers and the cloud."""

    def __init__(self, host: Host) -> None:
        self._host = host
        self._markers = Outlet(
            host,
            MarkerArray,
            CONTACT_SURFACE_MARKERS,
            marker_qos(),
            period=lambda: 1.0 / host.parameter("marker_rate"),
        )
        self._points = Outlet(host, PointCloud2, CONTACT_SURFACE_POINTS, contact_qos())
        self._shown: WorldSnapshot | None = None

    def is_heard(self) -> bool:
        """Tell whether either topic has subscribers."""
        return self._markers.is_heard() or self._points.is_heard()

    def has_work(self) -> bool:
        """Tell whether somebody listens to markers or the cloud."""
        return self._markers.is_due() or self._points.is_due()

    def prepare(self, snapshot: WorldSnapshot) -> None:
        """Do nothing: only the surfaces take long."""

    def update(self, snapshot: WorldSnapshot) -> None:
        """Publish the surfaces of ``snapshot``.

        Where they are late, those of the newest snapshot that has some are published, once.
        """
        is_in_time = self._host.answer("surfaces", snapshot) is not None
        found = self._host.newest_answer("surfaces")
        if found is None or not (is_in_time or found.snapshot is not self._shown):
            return
        self._shown = found.snapshot
        surfaces, _ = found.answer
        if self._markers.is_due():
            self._publish_markers(surfaces, found.snapshot)
        if self._points.is_due():
            self._points.take_newcomers()
            self._points.publish(
                face_points_to_msg(
                    surfaces, stamp_ns=found.snapshot.stamp, frame_id=self._host.world_frame
                )
            )

    def _publish_markers(self, surfaces: Any, snapshot: WorldSnapshot) -> None:
        self._markers.take_newcomers()
        scale = self._host.parameter("pressure_scale")
        message = self._wire.message(surfaces, scale=scale, stamp_ns=snapshot.stamp)
        self._markers.publish(message)

    @made_once
    def _wire(self) -> ContactSurfaceMarkerWire:
        return ContactSurfaceMarkerWire(self._host.world_frame, serialize_message)

    def vanish(self, snapshot: WorldSnapshot) -> None:
        """Take the triangles back."""
        if self._markers.is_heard():
            self._publish_markers((), snapshot)

    def close(self) -> None:
        """Stop being advertised."""
        self._markers.close()
        self._points.close()

    def counters(self) -> Mapping[str, Any]:
        """Return the number of times that surfaces were published."""
        return {
            "marker messages": self._markers.messages,
            "cloud messages": self._points.messages,
        }
