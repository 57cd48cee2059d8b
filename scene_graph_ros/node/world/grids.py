"""Voxel grids of a source, as far as its messages of maps are concerned. No rclpy here."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, TYPE_CHECKING

from msg_adapters.names import SceneNames
from scene_graph_ros.geometry.errors import NameConflictError, UnknownIdError
from scene_graph_ros.geometry.model.context import Context
from scene_graph_ros.geometry.model.ids import GeometryId, SourceId
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.node.world.intake import UNSTAMPED

if TYPE_CHECKING:
    from scene_graph_ros.geometry.model.voxel_set import VoxelSet

__all__ = ["NoGridError", "SourceGrids", "grids_by_source"]


class NoGridError(UnknownIdError):
    """Maps of a source of which nobody knows whose they are."""


@dataclass
class SourceGrids:
    """The voxel grids of one source; a context has their voxels.

    ``ids`` are the geometries by name, ``wanted`` is the name of the one that maps are about, ""
    for the only one. ``heard`` are those whose voxels a message brought, ``fresh`` has voxels that
    no context has yet, ``stamp`` is the newest, ns.
    """

    source: SourceId
    source_name: str
    wanted: str
    ids: Mapping[str, list[GeometryId]]
    names: SceneNames
    inspector: Any
    stamp: int = UNSTAMPED
    heard: set[GeometryId] = field(default_factory=set)
    fresh: dict[GeometryId, VoxelSet] = field(default_factory=dict)

    def grid(self) -> GeometryId:
        """Return the geometry that messages are about. Raises NoGridError."""
        named = [name for name in self.ids if self.wanted in ("", name)]
        found = [geometry_id for name in named for geometry_id in self.ids[name]]
        if len(found) == 1:
            return found[0]
        if not found:
            raise NoGridError(
                f"the source has no voxel grid {quoted(self.wanted)}, but"
                f" {quoted(sorted(self.ids))}"
            )
        raise NoGridError(
            f"the source has {len(found)} voxel grids that a map may be of,"
            f" {quoted(sorted(named))}: name the one in the scene file, sources: voxels: geometry;"
            " or have a source for each"
        )

    def check_frame(self, name: str, geometry_id: GeometryId, world_frame: str) -> None:
        """Raise UnknownIdError, or NameConflictError, unless maps of a frame fit a grid.

        The frame has to be the grid's own; the world's is that of an anchored one.
        """
        own = self.inspector.get_frame_id(geometry_id)
        if not name:
            raise UnknownIdError("a map has no frame_id, so nobody knows where it is")
        found = self.inspector.world_frame_id() if name == world_frame else self._named(name)
        if found != own:
            path = self.inspector.get_path(own)
            is_world = own == self.inspector.world_frame_id()
            raise UnknownIdError(
                f"a map is in {quoted(name)}, and the grid in"
                f" {quoted(world_frame if is_world else path)}: send maps in the grid's frame"
            )

    def _named(self, name: str) -> Any:
        for source in (self.source_name, None):
            try:
                return self.names.frame_id(name, source)
            except NameConflictError:
                raise
            except UnknownIdError:
                continue
        return None

    def put(self, geometry_id: GeometryId, voxels: VoxelSet, stamp: int) -> None:
        """Take voxels, of a time, ns."""
        self.fresh[geometry_id] = voxels
        self.stamp = stamp

    def bring(self, context: Context) -> None:
        """Give a context the fresh voxels."""
        context.set_voxels(self.source, self.fresh)
        self.heard.update(self.fresh)
        self.fresh.clear()

    def take_over(self, old: SourceGrids, before: Context, context: Context) -> None:
        """Take the state of the same grids in the scene before, and give a context voxels."""
        there = {geometry_id for found in self.ids.values() for geometry_id in found}
        self.heard = old.heard & there
        self.stamp = old.stamp
        voxels = {g: before.snapshot.voxel_set(g) for g in self.heard}
        context.set_voxels(self.source, voxels)

    def forget(self, after: int) -> None:
        """Forget a stamp later than that; the voxels hold."""
        self.stamp = UNSTAMPED if self.stamp > after else self.stamp


def grids_by_source(
    inspector: Any, records: Mapping[str, Any], names: SceneNames
) -> dict[str, SourceGrids]:
    """Return those of all sources that have some; ``records`` are those of sources by name."""
    by_owner: dict[SourceId, dict[str, list[GeometryId]]] = defaultdict(dict)
    for geometry_id in inspector.get_all_voxel_grid_ids():
        own = by_owner[inspector.get_owning_source_id(geometry_id)]
        own.setdefault(inspector.get_name(geometry_id), []).append(geometry_id)
    return {
        name: SourceGrids(
            record.id,
            name,
            record.voxels.geometry if record.voxels is not None else "",
            by_owner[record.id],
            names,
            inspector,
        )
        for name, record in records.items()
        if record.id in by_owner
    }
