"""Voxel grids that sensors fill. No rclpy here.

Imported where a source's sensor fills a voxel grid.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.model.context import Context
from scene_graph_ros.geometry.model.ids import GeometryId
from scene_graph_ros.geometry.model.voxel_set import VoxelSet
from scene_graph_ros.node.world.sensed import ids_by_name, SensedGeometry
from scene_graph_ros.sensing.seen_voxels import SeenVoxels

if TYPE_CHECKING:
    from msg_adapters.names import SceneNames
    from scene_graph_ros.node.world.sensor_state import Looked

__all__ = ["SensedGrid", "sensed_grids"]


@dataclass
class SensedGrid(SensedGeometry):
    """The voxel grids of one source, one of which sensors fill; a context has its voxels.

    ``fresh`` has voxels that no context has yet, ``voxels`` are those after all messages, None
    before the first one.
    """

    noun: ClassVar[str] = "voxel grid"

    fresh: dict[GeometryId, VoxelSet] = field(default_factory=dict)
    voxels: SeenVoxels | None = None

    def seen(self) -> SeenVoxels:
        """Return the voxels that there are after all messages; those to begin with before them."""
        if self.voxels is None:
            geometry_id = self.geometry()
            shape = self.inspector.get_shape(geometry_id)
            X_WG = self.inspector.get_pose_in_frame(geometry_id)
            return self._told_by(SeenVoxels(shape.occupancy, shape.voxel, X_WG))
        return self.voxels

    def _told_by(self, seen: SeenVoxels) -> SeenVoxels:
        """Return voxels that know which sensor told them, if one may go before the grid does."""
        if not self.sensors.keys() - {self.source_name}:
            return replace(seen, sensors=None)
        if seen.sensors is not None:
            return seen
        return replace(seen, sensors=np.full(seen.states.shape, -1, np.int16))

    def error(self, geometry_id: GeometryId) -> float:
        """Return 0: a depth ends in the voxel that it says."""
        return 0.0

    def take(self, looked: Looked, geometry_id: GeometryId, X_WG: NDArray[np.float64]) -> None:
        """Take the voxels that there are after a message."""
        self._see(geometry_id, looked.seen)

    def _see(self, geometry_id: GeometryId, seen: SeenVoxels) -> None:
        self.voxels = seen
        seen.states.flags.writeable = False
        shape = self.inspector.get_shape(geometry_id)
        self.fresh[geometry_id] = VoxelSet(shape, seen.states)

    def told(self, looked: Looked, message: str) -> dict[str, int]:
        """Return the counts of a message for diagnostics, by name."""
        counts = looked.counts
        return {
            "free voxels": counts.free,
            "occupied voxels": counts.occupied,
            "unknown voxels": counts.unknown,
            f"points of the newest {message}": len(looked.new.radii),
            "voxels freed by it": counts.freed,
            "voxels hit by it": counts.hit,
        }

    def expire(self, now: int) -> bool:
        """Have voxels unknown that were seen too long ago; tell whether there were any."""
        if self.voxels is None or now <= 0:
            return False
        seen = self.voxels.at(now)
        if seen is self.voxels:
            return False
        self._see(self.geometry(), seen)
        return True

    def bring(self, context: Context) -> None:
        """Give a context the fresh voxels."""
        context.set_voxels(self.source, self.fresh)
        self.heard.update(self.fresh)
        self.fresh.clear()

    def take_over(self, old: SensedGeometry, before: Context, context: Context) -> None:
        """Take the state of the same grids in the scene before, and give a context its voxels."""
        if not isinstance(old, SensedGrid):
            return
        self.heard = old.heard & {each for found in self.ids.values() for each in found}
        voxels = {g: before.snapshot.voxel_set(g) for g in self.heard}
        context.set_voxels(self.source, voxels)
        numbers = np.full(
            1 + max((s.number for s in old.sensors.values()), default=-1), -1, np.int16
        )
        for name, state in old.sensors.items():
            if name in self.sensors:
                numbers[state.number] = self.sensors[name].number
                self.sensors[name].take_over(state)
        if old.voxels is None or not self.heard:
            return
        seen = old.voxels.numbered(numbers)
        self.voxels = self._told_by(seen)
        if seen is not old.voxels:
            self._see(self.geometry(), self.voxels)
            self.bring(context)

    def forget(self, after: int) -> None:
        """Forget stamps later than that, and the present look; the voxels hold.

        States that were seen later than that expire as if they had been seen then.
        """
        super().forget(after)
        if self.voxels is not None:
            longest = max((state.settings.expires for state in self.sensors.values()), default=0.0)
            self.voxels = self.voxels.ended_by(after + int(longest * 1e9))


def sensed_grids(
    records: Iterable[Any], names: SceneNames, inspector: Any, world_frame: str
) -> Mapping[str, SensedGrid]:
    """Return those of sources whose sensor fills a grid, if they have one."""
    found = {}
    for record in records:
        grids = [
            each
            for each in inspector.get_all_voxel_grid_ids()
            if inspector.get_owning_source_id(each) == record.id
        ]
        if grids:
            by_name = ids_by_name(grids, inspector)
            its = record.id, record.name, record.cloud, by_name, names, inspector, world_frame
            found[record.name] = SensedGrid(*its)
    return found
