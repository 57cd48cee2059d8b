"""Markers of a role's deformable geometry."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial

from rclpy.serialization import serialize_message

from msg_adapters.wire.deformable_markers import DeformableMarkers, Positions
from scene_graph_ros.geometry import Role
from scene_graph_ros.geometry.model.ids import GeometryId
from scene_graph_ros.node.world.world import WorldSnapshot
from scene_graph_ros.views.deformables import deformable_items, DeformableItem

__all__ = ["RoleDeformables"]


class RoleDeformables:
    """Driven meshes of the deformable geometries with a role, for the markers of the role."""

    def __init__(self, role: Role, frame_id: str, warn: Callable[[int, Exception], None]) -> None:
        """Call ``warn`` with the id of a geometry that can't be shown, and why."""
        self._role = role
        self._warn = warn
        self._markers = self._new_markers(frame_id)
        self._shown: dict[int, GeometryId] = {}

    def set_items(self, snapshot: WorldSnapshot) -> None:
        """Take over which geometries there are."""
        ids = self._ids(snapshot)
        items = self._items(snapshot, ids)
        can_be_shown = {shown.item.geometry_id for shown in items}
        self._shown = {int(each): each for each in ids if int(each) in can_be_shown}
        self._markers.set_items(items)

    def _new_markers(self, frame_id: str) -> DeformableMarkers:
        return DeformableMarkers(serialize_message, frame_id=frame_id)

    def _ids(self, snapshot: WorldSnapshot) -> Sequence[GeometryId]:
        return snapshot.query.snapshot.state.deformable_ids(self._role)

    def _items(self, snapshot: WorldSnapshot, ids: Sequence[GeometryId]) -> list[DeformableItem]:
        return deformable_items(snapshot.inspector, self._role, ids, self._warn)

    def append(
        self, message: bytes, snapshot: WorldSnapshot, *, is_whole: bool
    ) -> tuple[bytes, int]:
        """Put the markers that are to be sent behind the others; also return how many."""
        return self._markers.append(
            message, self._positions(snapshot), snapshot.stamp, is_whole=is_whole
        )

    def _positions(self, snapshot: WorldSnapshot) -> Mapping[int, Positions]:
        moment = snapshot.query.snapshot
        result = {}
        for key, geometry_id in self._shown.items():
            result[key] = Positions(
                moment.configuration(geometry_id),
                partial(moment.driven_mesh_configurations, geometry_id, self._role),
            )
        return result
