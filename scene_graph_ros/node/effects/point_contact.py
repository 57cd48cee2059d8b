"""Point contact: all penetrating pairs, as data at every update and as markers for people.

Where contact surfaces or deformable contact are on, theirs go out with the points.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from rclpy.serialization import serialize_message
from visualization_msgs.msg import MarkerArray

from msg_adapters.contact_rows import deformable_rows, NO_ROWS, surface_rows
from msg_adapters.wire.contacts import ContactMarkerWire, ContactWire
from scene_graph_msgs.msg import ContactArray
from scene_graph_ros.geometry import Role
from scene_graph_ros.geometry.query.query_object import QueryObject
from scene_graph_ros.geometry.steps import between_steps
from scene_graph_ros.node.effects.effect import Host, Outlet
from scene_graph_ros.node.runtime.made_once import made_once
from scene_graph_ros.node.runtime.names import CONTACT_MARKERS, CONTACTS
from scene_graph_ros.node.runtime.qos import contact_qos, marker_qos
from scene_graph_ros.node.world.world import WorldSnapshot

__all__ = ["Penetrations", "PointContact", "contact_message"]


def contact_message(
    wire: ContactWire, snapshot: WorldSnapshot, points: Any, surfaces: Any, deformable: Any
) -> bytes:
    """Return the message about a snapshot, serialized; None is an answer that is not there."""
    return wire.message(
        points,
        snapshot.names,
        stamp_ns=snapshot.stamp,
        scene_version=snapshot.scene_version,
        surfaces=NO_ROWS if surfaces is None else surface_rows(surfaces),
        deformables=NO_ROWS if deformable is None else deformable_rows(deformable),
    )


class Penetrations:
    """All penetrating pairs, with a point each."""

    def __call__(self, snapshot: WorldSnapshot) -> Any:
        """Return the table."""
        # What the query would find out by itself, in steps: an edit prepares it beside updates.
        snapshot.query.snapshot.role_arrays(Role.PROXIMITY)
        between_steps()
        _ = snapshot.query.snapshot.proximity
        between_steps()
        return snapshot.ask(QueryObject.compute_point_pair_penetration)

    def counters(self, answer: Any) -> Mapping[str, Any]:
        """Return the number of contacts."""
        return {"penetrations": 0 if answer is None else len(answer)}


class _Contacts(NamedTuple):
    """The contacts of a snapshot: the answers that are published together."""

    sequence: int
    points: Any
    surfaces: Any
    deformable: Any

    def are(self, others: _Contacts | None) -> bool:
        """Tell whether others are these."""
        return (
            others is not None
            and self.sequence == others.sequence
            and self.points is others.points
            and self.surfaces is others.surfaces
            and self.deformable is others.deformable
        )


class PointContact:
    """Publishes ``~/contacts`` and ``~/contact_markers`` where somebody listens."""

    def __init__(self, host: Host) -> None:
        self._host = host
        self._contacts = Outlet(host, ContactArray, CONTACTS, contact_qos())
        self._markers = Outlet(
            host,
            MarkerArray,
            CONTACT_MARKERS,
            marker_qos(),
            period=lambda: 1.0 / host.parameter("marker_rate"),
        )
        self._told: _Contacts | None = None
        self._message = b""

    def is_heard(self) -> bool:
        """Tell whether contacts have subscribers at all."""
        return self._contacts.is_heard() or self._markers.is_heard()

    def has_work(self) -> bool:
        """Tell whether somebody listens to contacts or their markers."""
        return self._contacts.is_due() or self._markers.is_due()

    def prepare(self, snapshot: WorldSnapshot) -> None:
        """Find room for the contacts and names of a scene that is going to be."""
        table = snapshot.ask(QueryObject.compute_point_pair_penetration)
        self._contact_wire.prepare(table, snapshot.names)

    def update(self, snapshot: WorldSnapshot) -> None:
        """Publish the contacts of ``snapshot``; where surfaces are late, all pairs have points."""
        found = self._host.answer("surfaces", snapshot)
        if found is None:
            surfaces, points = None, self._host.answer("penetrations", snapshot)
        else:
            surfaces, points = found
        if points is not None:
            self._publish(snapshot, points, surfaces)

    def _publish(self, snapshot: WorldSnapshot, points: Any, surfaces: Any) -> None:
        if self._contacts.is_due():
            deformable = self._host.answer("deformable contact", snapshot)
            contacts = _Contacts(snapshot.sequence, points, surfaces, deformable)
            self._publish_contacts(snapshot, contacts)
        if self._markers.is_due():
            self._publish_markers(snapshot, points)

    def _publish_contacts(self, snapshot: WorldSnapshot, contacts: _Contacts) -> None:
        self._contacts.take_newcomers()
        if not contacts.are(self._told):
            self._message = contact_message(
                self._contact_wire,
                snapshot,
                contacts.points,
                contacts.surfaces,
                contacts.deformable,
            )
            self._told = contacts
        self._contacts.publish(self._message)
        self._host.contacts_published(snapshot)

    def _publish_markers(self, snapshot: WorldSnapshot, points: Any) -> None:
        self._markers.take_newcomers()
        message = self._marker_wire.message(
            points,
            stamp_ns=snapshot.stamp,
            point_diameter=self._host.parameter("contact_point_size"),
            normal_length=self._host.parameter("contact_normal_length"),
        )
        self._markers.publish(message)

    @made_once
    def _contact_wire(self) -> ContactWire:
        return ContactWire(self._host.world_frame, serialize_message)

    @made_once
    def _marker_wire(self) -> ContactMarkerWire:
        return ContactMarkerWire(self._host.world_frame, serialize_message)

    def vanish(self, snapshot: WorldSnapshot) -> None:
        """Publish once more: without geometry there are no contacts."""
        if self.has_work():
            table = snapshot.ask(QueryObject.compute_point_pair_penetration)
            self._publish(snapshot, table, None)

    def close(self) -> None:
        """Stop being advertised."""
        self._contacts.close()
        self._markers.close()

    def counters(self) -> Mapping[str, Any]:
        """Return the number of times that contacts were published."""
        return {
            "contact messages": self._contacts.messages,
            "marker messages": self._markers.messages,
        }
