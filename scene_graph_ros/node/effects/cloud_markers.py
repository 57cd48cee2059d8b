"""Markers of a role's clouds."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial

from rclpy.serialization import serialize_message

from msg_adapters.wire.cloud_markers import CloudMarkers
from msg_adapters.wire.deformable_markers import DeformableMarkers, Positions
from scene_graph_ros.geometry import Role
from scene_graph_ros.geometry.model.ids import GeometryId
from scene_graph_ros.node.effects.deformable_markers import RoleDeformables
from scene_graph_ros.node.world.world import WorldSnapshot
from scene_graph_ros.views.clouds import balls_in_world, cloud_ids, cloud_items, placed_version
from scene_graph_ros.views.deformables import DeformableItem

__all__ = ["RoleClouds"]


class RoleClouds(RoleDeformables):
    """Balls of the clouds with a role, for the markers of the role."""

    def __init__(self, role: Role, frame_id: str, warn: Callable[[int, Exception], None]) -> None:
        """Take the arguments of markers of deformable geometry."""
        super().__init__(role, frame_id, warn)
        self._versions: dict[int, tuple[object, bytes]] = {}

    def _new_markers(self, frame_id: str) -> DeformableMarkers:
        return CloudMarkers(serialize_message, frame_id=frame_id)

    def _ids(self, snapshot: WorldSnapshot) -> Sequence[GeometryId]:
        return cloud_ids(snapshot.query.snapshot, self._role)

    def _items(self, snapshot: WorldSnapshot, ids: Sequence[GeometryId]) -> list[DeformableItem]:
        return cloud_items(snapshot.inspector, self._role, ids)

    def _positions(self, snapshot: WorldSnapshot) -> Mapping[int, Positions]:
        moment = snapshot.query.snapshot
        return {
            key: Positions(
                self._version(key, placed_version(moment, each)),
                partial(balls_in_world, moment, each),
            )
            for key, each in self._shown.items()
        }

    def _version(self, key: int, version: tuple[object, bytes]) -> object:
        """Return the same object for a cloud whose points and pose are the same."""
        if self._versions.get(key) != version:
            self._versions[key] = version
        return self._versions[key]
