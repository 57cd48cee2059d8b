"""Contact surfaces: with the other contacts, as coloured triangles, and as a cloud of faces.

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
from scene_graph_ros.node.effects.beside import Beside
from scene_graph_ros.node.effects.effect import Host, Outlet
from scene_graph_ros.node.runtime.made_once import made_once
from scene_graph_ros.node.runtime.names import CONTACT_SURFACE_MARKERS, CONTACT_SURFACE_POINTS
from scene_graph_ros.node.runtime.qos import contact_qos, marker_qos
from scene_graph_ros.node.world.world import WorldSnapshot

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
        self._beside = Beside(self._compute, host.request_update)
        self._shown: WorldSnapshot | None = None
        self._computed = 0
        self._late = 0

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
        """Compute the surfaces of ``snapshot``, once, and publish them where they are heard.

        Where they are late, those of the newest snapshot that has some are published, once.
        """
        is_in_time = self.answer(snapshot) is not None
        self._late += not is_in_time
        found = self._beside.newest
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

    def answer(self, snapshot: WorldSnapshot) -> tuple[Any, Any] | None:
        """Return the surfaces, and the penetrations of the pairs that have none.

        None where that takes longer than contacts of anybody may be apart: it goes on beside the
        updates, which are asked for again when it is done.
        """
        period = 1.0 / self._host.parameter("min_update_rate")
        answer: tuple[Any, Any] | None = self._beside.ask(snapshot, period)
        return answer

    def seconds_beside(self) -> float:
        """Return how long surfaces take, also those that are being computed."""
        return self._beside.seconds()

    def _compute(self, snapshot: WorldSnapshot) -> tuple[Any, Any]:
        self._computed += 1
        answer: tuple[Any, Any] = snapshot.ask(_QUESTION, ContactRepresentation.POLYGON)
        return answer

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
        self._beside.close()
        self._markers.close()
        self._points.close()

    def counters(self) -> Mapping[str, Any]:
        """Return how often surfaces were computed and published, and how many there are."""
        found = self._beside.newest
        surfaces: Any = () if found is None else found.answer[0]
        return {
            "computed": self._computed,
            "updates without, as they were late": self._late,
            "surfaces": len(surfaces),
            "faces": len(surfaces.face_areas) if len(surfaces) else 0,
            "marker messages": self._markers.messages,
            "cloud messages": self._points.messages,
        }
