"""Topics of maps: one subscription per source that has a voxel grid."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING

from rclpy.node import Node

from scene_graph_ros.node.runtime.loop import OwnThreadGroup
from scene_graph_ros.node.world.intake import Intake
from scene_graph_ros.node.world.scene import SourceRecord
from scene_graph_ros.node.world.source_channel import Inputs
from scene_graph_ros.node.world.source_topics import VOXELS
from scene_graph_ros.node.world.world import World

if TYPE_CHECKING:
    from scene_graph_ros.node.world.grids import SourceGrids
    from scene_graph_ros.node.world.voxel_channel import VoxelChannel

__all__ = ["VoxelInputs"]

_QUEUED = 2
"""Messages that the middleware may hold per source."""

_KERNELS = "maps"
"""The group that reads maps; no subscription opens before it is compiled."""


class VoxelInputs(Inputs["VoxelChannel"]):
    """All subscriptions of the node to maps."""

    def __init__(
        self,
        node: Node,
        world: World,
        group: OwnThreadGroup,
        on_change: Callable[[], None],
        most_voxels: int,
        lack: Callable[[str], str],
    ) -> None:
        """Call ``on_change`` when a subscription is replaced by another.

        A map has ``most_voxels`` at most; ``lack`` says which of a group's kernels are missing.
        """
        super().__init__(node, world, group, on_change, noun=VOXELS, queued=_QUEUED)
        self._most_voxels, self._lack = most_voxels, lack

    def _wanted(self) -> Iterable[str]:
        wanted = self._world.snapshot.with_grids
        return () if wanted and self._lack(_KERNELS) else wanted

    def _target(self, name: str) -> SourceGrids | None:
        return self._world.grids.get(name)

    def _make(self, record: SourceRecord) -> VoxelChannel:
        from scene_graph_ros.node.world.voxel_channel import VoxelChannel

        intake = Intake(record.name, self._warn)
        return VoxelChannel(record, intake, self._most_voxels, self._world.world_frame)
