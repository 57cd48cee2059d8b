"""Deformable contact: computed for who publishes the contacts, and only then."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from scene_graph_ros.geometry.query.query_object import QueryObject
from scene_graph_ros.node.effects.effect import Host
from scene_graph_ros.node.world.world import WorldSnapshot

__all__ = ["DeformableContactEffect"]


class DeformableContactEffect:
    """Has the contacts of deformable geometry ready when somebody listens to ``~/contacts``."""

    def __init__(self, host: Host) -> None:
        self._host = host
        self._computed_for = -1
        self._contact: Any = ()
        self._computed = 0

    def has_work(self) -> bool:
        """Tell whether somebody listens to contacts."""
        contacts = self._host.effect("point_contact")
        return contacts is not None and contacts.wants_contacts()

    @staticmethod
    def prepare(host: Host, snapshot: WorldSnapshot) -> None:
        """Find the contacts of a scene that is going to be, if somebody listens to contacts."""
        contacts = host.effect("point_contact")
        if contacts is not None and contacts.is_heard():
            snapshot.ask(QueryObject.compute_deformable_contact)

    def update(self, snapshot: WorldSnapshot) -> None:
        """Compute the contacts of ``snapshot``, once."""
        self.contact(snapshot)

    def contact(self, snapshot: WorldSnapshot) -> Any:
        """Return the deformable contact."""
        if snapshot.sequence != self._computed_for:
            self._contact = snapshot.ask(QueryObject.compute_deformable_contact)
            self._computed_for = snapshot.sequence
            self._computed += 1
        return self._contact

    def vanish(self, snapshot: WorldSnapshot) -> None:
        """Take nothing back: the next contacts are without those of this effect."""

    def close(self) -> None:
        """Stop; nothing is advertised by this effect alone."""

    def counters(self) -> Mapping[str, Any]:
        """Return how often contact was computed, and how much of it there is."""
        return {
            "computed": self._computed,
            "surfaces": len(self._contact),
            "contact points": sum(surface.num_contact_points for surface in self._contact),
        }
