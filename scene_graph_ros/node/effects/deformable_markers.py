"""What the markers of a role need where the role has deformable geometry."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

from rclpy.serialization import serialize_message

from msg_adapters.deformable_markers import DeformableItem
from msg_adapters.scene import marker_items
from msg_adapters.wire.deformable_markers import DeformableMarkers, Positions
from scene_graph_ros.geometry import Role
from scene_graph_ros.geometry.errors import SceneGraphError
from scene_graph_ros.geometry.model.ids import GeometryId
from scene_graph_ros.node.world import WorldSnapshot

__all__ = ["RoleDeformables"]


class RoleDeformables:
    """Driven meshes of the deformable geometries with a role, for the markers of the role."""

    def __init__(self, role: Role, frame_id: str, warn: Callable[[int, Exception], None]) -> None:
        """Call ``warn`` with the id of a geometry that can't be shown, and why."""
        self._role = role
        self._warn = warn
        self._markers = DeformableMarkers(serialize_message, frame_id=frame_id)
        self._shown: dict[int, GeometryId] = {}

    def set_items(self, snapshot: WorldSnapshot) -> None:
        """Take over which geometries there are."""
        role, inspector = self._role, snapshot.inspector
        ids = snapshot.query.snapshot.state.deformable_ids(role)
        items = []
        self._shown = {}
        described = marker_items(inspector, snapshot.names, role, ids)
        for geometry_id, item in zip(ids, described, strict=True):
            try:
                (surface,) = inspector.get_driven_meshes(geometry_id, role)
            except SceneGraphError as error:
                self._warn(int(geometry_id), error)
                continue
            items.append(DeformableItem(item, surface.triangles))
            self._shown[int(geometry_id)] = geometry_id
        self._markers.set_items(items)

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
