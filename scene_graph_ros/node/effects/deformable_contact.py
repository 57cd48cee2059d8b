"""Contacts of deformable geometry: an answer for whoever publishes the contacts."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from scene_graph_ros.geometry.query.query_object import QueryObject
from scene_graph_ros.node.world.world import WorldSnapshot

__all__ = ["DeformableContact"]


class DeformableContact:
    """The contacts of deformable geometry."""

    def __call__(self, snapshot: WorldSnapshot) -> Any:
        """Return the contact surfaces, one for each pair."""
        return snapshot.ask(QueryObject.compute_deformable_contact)

    def counters(self, answer: Any) -> Mapping[str, Any]:
        """Return the numbers of surfaces and points."""
        surfaces = () if answer is None else answer
        return {
            "surfaces": len(surfaces),
            "contact points": sum(surface.num_contact_points for surface in surfaces),
        }
