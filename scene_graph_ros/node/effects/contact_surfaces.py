"""Contact surfaces: with the other contacts, as coloured triangles, and as a cloud of faces.

Imported, and its bodies built, only while the scene has compliant geometry.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import Any

from rclpy.serialization import serialize_message
from sensor_msgs.msg import PointCloud2
from visualization_msgs.msg import MarkerArray

from msg_adapters.contact_surface_markers import ContactSurfaceMarkerWire
from msg_adapters.contact_surfaces import face_points_to_msg
from scene_graph_ros.geometry.query.query_object import QueryObject
from scene_graph_ros.geometry.query.representation import ContactRepresentation
from scene_graph_ros.node.effects.effect import Host, Outlet
from scene_graph_ros.node.names import CONTACT_SURFACE_MARKERS, CONTACT_SURFACE_POINTS
from scene_graph_ros.node.qos import contact_qos, marker_qos
from scene_graph_ros.node.world import WorldSnapshot

__all__ = ["ContactSurfacesEffect"]


_QUESTION = QueryObject.compute_contact_surfaces_with_fallback


class ContactSurfacesEffect:
    """Publishes markers and the cloud, and has surfaces for who publishes the contacts.

    Faces are polygons: there are fewer of them than triangles.
    """

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
        self._computed_for = -1
        self._answer: tuple[Any, Any] = ((), ())
        self._computed = 0

    def has_work(self) -> bool:
        """Tell whether somebody listens to surfaces in any form."""
        contacts = self._host.effect("point_contact")
        is_wanted = contacts is not None and contacts.has_work()
        return is_wanted or self._markers.is_due() or self._points.is_due()

    @staticmethod
    def prepare(host: Host, snapshot: WorldSnapshot) -> None:
        """Make bodies and find surfaces of a scene that is going to be, if somebody listens."""
        effect: ContactSurfacesEffect | None = host.effect("contact_surfaces")
        contacts = host.effect("point_contact")
        if (effect is not None and effect._is_heard()) or (
            contacts is not None and contacts.is_heard()
        ):
            snapshot.ask(_QUESTION, ContactRepresentation.POLYGON)

    def _is_heard(self) -> bool:
        return self._markers.is_heard() or self._points.is_heard()

    def update(self, snapshot: WorldSnapshot) -> None:
        """Compute the surfaces of ``snapshot``, once, and publish them where they are heard."""
        surfaces = self.surfaces(snapshot)
        if self._markers.is_due():
            self._publish_markers(surfaces, snapshot)
        if self._points.is_due():
            self._points.take_newcomers()
            self._points.publish(
                face_points_to_msg(
                    surfaces, stamp_ns=snapshot.stamp, frame_id=self._host.world_frame
                )
            )

    def surfaces(self, snapshot: WorldSnapshot) -> Any:
        """Return the contact surfaces."""
        return self._answers(snapshot)[0]

    def penetrations(self, snapshot: WorldSnapshot) -> Any:
        """Return the penetrations of the pairs that have no surface."""
        return self._answers(snapshot)[1]

    def _answers(self, snapshot: WorldSnapshot) -> tuple[Any, Any]:
        if snapshot.sequence != self._computed_for:
            self._answer = snapshot.ask(_QUESTION, ContactRepresentation.POLYGON)
            self._computed_for = snapshot.sequence
            self._computed += 1
        return self._answer

    def _publish_markers(self, surfaces: Any, snapshot: WorldSnapshot) -> None:
        self._markers.take_newcomers()
        scale = self._host.parameter("pressure_scale")
        message = self._wire.message(surfaces, scale=scale, stamp_ns=snapshot.stamp)
        self._markers.publish(message)

    @cached_property
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
        """Return how often surfaces were computed and published, and how many there are."""
        surfaces = self._answer[0]
        return {
            "computed": self._computed,
            "surfaces": len(surfaces),
            "faces": len(surfaces.face_areas) if len(surfaces) else 0,
            "marker messages": self._markers.messages,
            "cloud messages": self._points.messages,
        }
