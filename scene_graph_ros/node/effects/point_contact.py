"""Point contact: all penetrating pairs, as data at every update and as markers for people.

Where contact surfaces or deformable contact are on, theirs go out with the points.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
import time
from typing import Any

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

__all__ = ["PointContact"]

_RECENT = 100
"""Updates that the mean time of the query is taken over."""


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
        self._computed_for = -1
        self._beside: tuple[Any, ...] = ()
        self._table: Any = None
        self._surfaces = NO_ROWS
        self._lacks_surfaces = False
        self._message: bytes | None = None
        self._computed = 0
        self._accuracy = ""
        self._seconds: deque[float] = deque(maxlen=_RECENT)

    def has_work(self) -> bool:
        """Tell whether somebody listens to contacts or their markers."""
        return self.wants_contacts() or self._markers.is_due()

    def is_heard(self) -> bool:
        """Tell whether contacts have subscribers at all."""
        return self._contacts.is_heard() or self._markers.is_heard()

    def wants_contacts(self) -> bool:
        """Tell whether somebody listens to contacts."""
        return self._contacts.is_due()

    def update(self, snapshot: WorldSnapshot) -> None:
        """Publish the contacts of ``snapshot``, computed once even if published again."""
        # These effects may come on or go while the snapshot stays.
        beside = tuple(map(self._host.effect, ("contact_surfaces", "deformable_contact")))
        if beside != self._beside:
            self._beside, self._computed_for = beside, -1
        if snapshot.sequence != self._computed_for or self._lacks_surfaces:
            self._compute(snapshot)
        if self._contacts.is_due():
            self._publish_contacts(snapshot)
        if self._markers.is_due():
            self._publish_markers(snapshot)

    @staticmethod
    def prepare(host: Host, snapshot: WorldSnapshot) -> None:
        """Find the contacts of a scene that is going to be, if somebody listens to them."""
        effect: PointContact | None = host.effect("point_contact")
        if effect is not None and effect.is_heard():
            # What the query would find out by itself, in steps.
            snapshot.query.snapshot.role_arrays(Role.PROXIMITY)
            between_steps()
            _ = snapshot.query.snapshot.proximity
            between_steps()
            table = snapshot.ask(QueryObject.compute_point_pair_penetration)
            between_steps()
            effect._contact_wire.prepare(table, snapshot.names)

    def _compute(self, snapshot: WorldSnapshot) -> None:
        """Ask for the contacts; where surfaces are late, all pairs have points alone."""
        effect = self._host.effect("contact_surfaces")
        answer = None if effect is None else effect.answer(snapshot)
        was_lacking, self._lacks_surfaces = self._lacks_surfaces, effect is not None and not answer
        if snapshot.sequence == self._computed_for and was_lacking == self._lacks_surfaces:
            return
        with self._timed(snapshot):
            if answer is None:
                self._table = snapshot.ask(QueryObject.compute_point_pair_penetration)
                self._surfaces = NO_ROWS
            else:
                surfaces, self._table = answer
                self._surfaces = surface_rows(surfaces)
        self._message = None
        self._computed_for = snapshot.sequence
        self._computed += 1

    @contextmanager
    def _timed(self, snapshot: WorldSnapshot) -> Iterator[None]:
        """Note what the tier of accuracy costs."""
        if snapshot.query.accuracy != self._accuracy:
            self._accuracy = snapshot.query.accuracy
            self._seconds.clear()
        begin = time.perf_counter()
        yield
        self._seconds.append(time.perf_counter() - begin)

    def _publish_contacts(self, snapshot: WorldSnapshot) -> None:
        self._contacts.take_newcomers()
        if self._message is None:
            self._message = self._contact_wire.message(
                self._table,
                snapshot.names,
                stamp_ns=snapshot.stamp,
                scene_version=snapshot.scene_version,
                **self._beside_points(snapshot),
            )
        self._contacts.publish(self._message)
        self._host.contacts_published(snapshot)

    def _beside_points(self, snapshot: WorldSnapshot) -> dict[str, Any]:
        """Return the contacts of other kinds, as far as their effects are on."""
        kinds = {"surfaces": self._surfaces}
        deformables = self._host.effect("deformable_contact")
        if deformables is not None:
            kinds["deformables"] = deformable_rows(deformables.contact(snapshot))
        return kinds

    def _publish_markers(self, snapshot: WorldSnapshot) -> None:
        self._markers.take_newcomers()
        message = self._marker_wire.message(
            self._table,
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
            self.update(snapshot)

    def close(self) -> None:
        """Stop being advertised."""
        self._contacts.close()
        self._markers.close()

    def counters(self) -> Mapping[str, Any]:
        """Return how often contacts were computed and published, how exactly, at what cost."""
        seconds = list(self._seconds)
        return {
            "accuracy": self._accuracy,
            "time at this accuracy, mean (s)": sum(seconds) / len(seconds) if seconds else 0.0,
            "computed": self._computed,
            "surfaces are late": self._lacks_surfaces,
            "contact messages": self._contacts.messages,
            "marker messages": self._markers.messages,
        }
