"""Markers of a role's height fields."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

from msg_adapters.wire.deformable_markers import Positions
from scene_graph_ros.geometry import Role
from scene_graph_ros.geometry.model.ids import GeometryId
from scene_graph_ros.node.effects.deformable_markers import RoleDeformables
from scene_graph_ros.node.world.world import WorldSnapshot
from scene_graph_ros.views.deformables import DeformableItem
from scene_graph_ros.views.height_fields import (
    field_ids,
    field_items,
    placed_heights,
    surface_in_world,
)

__all__ = ["RoleFields"]


class RoleFields(RoleDeformables):
    """Surfaces of the height fields with a role, for the markers of the role."""

    def __init__(self, role: Role, frame_id: str, warn: Callable[[int, Exception], None]) -> None:
        """Take the arguments of markers of deformable geometry."""
        super().__init__(role, frame_id, warn)
        self._versions: dict[int, tuple[object, bytes]] = {}

    def _ids(self, snapshot: WorldSnapshot) -> Sequence[GeometryId]:
        return field_ids(snapshot.query.snapshot, self._role)

    def _items(self, snapshot: WorldSnapshot, ids: Sequence[GeometryId]) -> list[DeformableItem]:
        return field_items(snapshot.inspector, self._role, ids)

    def _positions(self, snapshot: WorldSnapshot) -> Mapping[int, Positions]:
        moment = snapshot.query.snapshot
        return {
            key: Positions(
                self._version(key, placed_heights(moment, each)),
                partial(_surfaces, moment, each),
            )
            for key, each in self._shown.items()
        }

    def _version(self, key: int, version: tuple[object, bytes]) -> object:
        """Return the same object for a field whose heights and pose are the same."""
        if self._versions.get(key) != version:
            self._versions[key] = version
        return self._versions[key]


def _surfaces(moment: Any, geometry_id: GeometryId) -> list[Any]:
    return [surface_in_world(moment, geometry_id)]
