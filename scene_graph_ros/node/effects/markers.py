"""Markers of the geometries of a role, in the world: all at first, then the moved ones."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import ClassVar, NamedTuple, TYPE_CHECKING

from ament_index_python.packages import get_packages_with_prefixes
from rclpy.serialization import serialize_message
from visualization_msgs.msg import MarkerArray

from msg_adapters.markers import marker_from_shape
from msg_adapters.scene import marker_items
from msg_adapters.wire.markers import MarkerWire, PreparedMarkers
from scene_graph_msgs.msg import GeometryName
from scene_graph_ros.geometry import Role
from scene_graph_ros.geometry.errors import SceneGraphError
from scene_graph_ros.geometry.shapes.element_shape import ElementKind
from scene_graph_ros.geometry.steps import between_steps
from scene_graph_ros.node.effects.effect import Host, Outlet
from scene_graph_ros.node.runtime.made_once import made_once
from scene_graph_ros.node.runtime.names import (
    MARKERS_ILLUSTRATION,
    MARKERS_PERCEPTION,
    MARKERS_PROXIMITY,
)
from scene_graph_ros.node.runtime.qos import marker_qos
from scene_graph_ros.node.world.world import WorldSnapshot
from scene_graph_ros.views.draw_list import DrawItem

if TYPE_CHECKING:
    from scene_graph_ros.node.effects.deformable_markers import RoleDeformables

__all__ = ["IllustrationMarkers", "PerceptionMarkers", "ProximityMarkers"]


def package_shares() -> dict[str, Path]:
    """Return the share folder of each installed package, by which viewers find meshes."""
    prefixes = get_packages_with_prefixes()
    return {name: Path(prefix) / "share" / name for name, prefix in prefixes.items()}


class _Ready(NamedTuple):
    """The markers of one version of the scene, and the rows of poses they are for (None: all)."""

    scene_version: int
    markers: PreparedMarkers
    rows: list[int] | None


class RoleMarkers:
    """Publishes the markers of one role where somebody listens."""

    ROLE: ClassVar[Role]
    TOPIC: ClassVar[str]

    def __init__(self, host: Host) -> None:
        self._outlet = Outlet(
            host,
            MarkerArray,
            self.TOPIC,
            marker_qos(),
            period=lambda: 1.0 / host.parameter("marker_rate"),
        )
        self._logger = host.node.get_logger()
        self._frame_id = host.world_frame
        self._scene_version = -1
        self._sequence = -1
        self._unshown: set[int] = set()
        self._items: dict[int, tuple[GeometryName, DrawItem]] = {}
        self._ready: _Ready | None = None
        self._rows: list[int] | None = None
        self._placed = 0
        self._deformables: RoleDeformables | None = None
        self._clouds: RoleDeformables | None = None
        self._fields: RoleDeformables | None = None

    def is_heard(self) -> bool:
        """Tell whether the topic has subscribers."""
        return self._outlet.is_heard()

    def has_work(self) -> bool:
        """Tell whether somebody listens and the last message is long enough ago."""
        return self._outlet.is_due()

    def update(self, snapshot: WorldSnapshot) -> None:
        """Publish all markers to newcomers, else deletions and moved ones; nothing if none.

        A viewer that has missed messages may show removed items: it is made to start over.
        """
        starts_over = self._outlet.take_missed()
        is_whole = self._outlet.take_newcomers() or starts_over
        if snapshot.sequence == self._sequence and not is_whole:
            return
        if snapshot.scene_version != self._scene_version:
            self._set_items(snapshot)
        self._sequence = snapshot.sequence
        X_WG = snapshot.query.snapshot.X_WG_of(self.ROLE)
        if self._rows is not None:
            X_WG = X_WG[self._rows]
        message, count = self._wire.message(
            X_WG, snapshot.stamp, is_whole=is_whole, starts_over=starts_over
        )
        for moving in (self._deformables, self._clouds, self._fields):
            if moving is not None:
                message, more = moving.append(message, snapshot, is_whole=is_whole)
                count += more
        if count or is_whole:
            self._placed += count
            self._outlet.publish(message)

    @made_once
    def _wire(self) -> MarkerWire:
        """The markers in bytes, made when somebody listens: by an update, or an edit beside it."""
        return MarkerWire(
            serialize_message, frame_id=self._frame_id, package_shares=package_shares()
        )

    def prepare(self, snapshot: WorldSnapshot) -> None:
        """Make the markers of a scene that is going to be."""
        snapshot.query.snapshot.role_arrays(self.ROLE)
        between_steps()
        self._ready = self._make_ready(snapshot)

    def _make_ready(self, snapshot: WorldSnapshot) -> _Ready:
        """Make the markers of a scene; items that can't be shown are left out."""
        snapshot.query.snapshot.state.deformable_ids(self.ROLE)
        snapshot.query.snapshot.state.element_ids(self.ROLE)
        items, rows = self._items_of(snapshot), None
        between_steps()
        try:
            markers = self._wire.prepare(items)
        except SceneGraphError:
            # A mesh that can't be shown must not hide the others: leave only that one out.
            rows = [row for row, item in enumerate(items) if self._can_show(item)]
            markers = self._wire.prepare([items[row] for row in rows])
        return _Ready(snapshot.scene_version, markers, rows)

    def _items_of(self, snapshot: WorldSnapshot) -> list[DrawItem]:
        """Return the items to show; those of the same names are the same, by `SceneNames`."""
        names, known = snapshot.names, self._items
        ids = snapshot.query.snapshot.role_arrays(self.ROLE).ids.tolist()
        kept = {i: known[i] for i in ids if i in known and names.known_name(i) is known[i][0]}
        new = [i for i in ids if i not in kept]
        made = marker_items(snapshot.inspector, names, self.ROLE, new, mesh_hulls=True)
        kept.update((i, (names.geometry_name(i), item)) for i, item in zip(new, made, strict=True))
        self._items = kept
        return [kept[i][1] for i in ids]

    def _set_items(self, snapshot: WorldSnapshot) -> None:
        ready = self._ready
        if ready is None or ready.scene_version != snapshot.scene_version:
            # What is ready, if anything, is for an edit that is still going to count.
            ready = self._make_ready(snapshot)
        self._wire.take(ready.markers)
        self._rows = ready.rows
        self._set_deformables(snapshot)
        self._scene_version = snapshot.scene_version

    def _set_deformables(self, snapshot: WorldSnapshot) -> None:
        """Show deformable geometry, clouds and fields; their modules are imported for some."""
        if self._deformables is None and snapshot.query.snapshot.state.deformable_ids(self.ROLE):
            from scene_graph_ros.node.effects.deformable_markers import RoleDeformables

            self._deformables = RoleDeformables(self.ROLE, self._frame_id, self._cannot_show)
        elements = snapshot.query.snapshot.state.element_ids(self.ROLE)
        kinds = {snapshot.inspector.get_shape(each).kind for each in elements}
        if self._clouds is None and ElementKind.POINT_CLOUD in kinds:
            from scene_graph_ros.node.effects.cloud_markers import RoleClouds

            self._clouds = RoleClouds(self.ROLE, self._frame_id, self._cannot_show)
        if self._fields is None and kinds & {ElementKind.HEIGHT_FIELD, ElementKind.VOXEL_GRID}:
            from scene_graph_ros.node.effects.field_markers import RoleFields

            self._fields = RoleFields(self.ROLE, self._frame_id, self._cannot_show)
        for moving in (self._deformables, self._clouds, self._fields):
            if moving is not None:
                moving.set_items(snapshot)

    def _can_show(self, item: DrawItem) -> bool:
        try:
            marker_from_shape(item, frame_id="")
        except SceneGraphError as error:
            self._cannot_show(item.geometry_id, error)
            return False
        return True

    def _cannot_show(self, geometry_id: int, error: Exception) -> None:
        if geometry_id not in self._unshown:
            self._unshown.add(geometry_id)
            self._logger.warning(f"geometry {geometry_id} can't be shown: {error}")

    def vanish(self, snapshot: WorldSnapshot) -> None:
        """Delete all markers that were published."""
        self.update(snapshot)

    def close(self) -> None:
        """Stop being advertised."""
        self._outlet.close()

    def counters(self) -> Mapping[str, int]:
        """Return counts of markers placed and messages published."""
        return {"markers placed": self._placed, "messages": self._outlet.messages}


class IllustrationMarkers(RoleMarkers):
    """Markers of the illustration role."""

    ROLE = Role.ILLUSTRATION
    TOPIC = MARKERS_ILLUSTRATION


class ProximityMarkers(RoleMarkers):
    """Markers of the proximity role: meshes as their hulls unless they ask for triangles."""

    ROLE = Role.PROXIMITY
    TOPIC = MARKERS_PROXIMITY


class PerceptionMarkers(RoleMarkers):
    """Markers of the perception role."""

    ROLE = Role.PERCEPTION
    TOPIC = MARKERS_PERCEPTION
