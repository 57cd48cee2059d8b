"""Topics of sensors: subscriptions of each source that fills a cloud or a voxel grid."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, Generic, TYPE_CHECKING, TypeVar

from rclpy.node import Node

from scene_graph_ros.node.runtime.loop import OwnThreadGroup
from scene_graph_ros.node.world.intake import Intake
from scene_graph_ros.node.world.scene import SourceRecord
from scene_graph_ros.node.world.sensor_worker import Worker
from scene_graph_ros.node.world.source_channel import Inputs, SourceChannel
from scene_graph_ros.node.world.source_topics import DEPTH_IMAGES
from scene_graph_ros.node.world.time_limits import TimeLimits
from scene_graph_ros.node.world.world import World
from scene_graph_ros.scene_files.sensor_settings import DepthSettings

if TYPE_CHECKING:
    from scene_graph_ros.node.world.depth_channel import DepthChannel, InfoChannel
    from scene_graph_ros.node.world.point_channel import PointChannel
    from scene_graph_ros.node.world.sensed import SensedGeometry

__all__ = ["KERNELS", "DepthInputs", "InfoInputs", "PointInputs"]

_QUEUED = 2
"""Messages that the middleware may hold per source."""

KERNELS = "sensing"
"""The group that filters and clears; no subscription that needs it opens before it is compiled."""

_GRID_KERNELS = "maps"
"""The group that fills voxel grids."""

C = TypeVar("C", bound=SourceChannel[Any, Any])


class _SensorInputs(Inputs[C], Generic[C]):
    """All subscriptions of the node to one kind of a sensor's messages."""

    def __init__(
        self,
        node: Node,
        world: World,
        group: OwnThreadGroup,
        on_change: Callable[[], None],
        noun: str,
    ) -> None:
        super().__init__(node, world, group, on_change, noun=noun, queued=_QUEUED)

    def collect(self, limits: TimeLimits) -> tuple[set[str], int | None]:
        """Apply messages, and forget what is too old; return the sources that changed."""
        moved, arrival = super().collect(limits)
        records, clouds = self._world.snapshot.records, self._world.clouds
        opened = {records[name].filled for name in self._channels.open if name in records}
        changed = {records[name].filled for name in moved}
        there = opened & clouds.keys()
        changed.update(name for name in there if clouds[name].expire(limits.now))
        return changed, arrival

    def _senders(self) -> list[SourceRecord]:
        snapshot = self._world.snapshot
        return [each for each in snapshot.records.values() if each.filled in snapshot.sensing]

    def _target(self, name: str) -> SensedGeometry | None:
        return self._world.clouds.get(self._world.records[name].filled)


V = TypeVar("V", bound="PointChannel | DepthChannel")


class _ViewInputs(_SensorInputs[V], Generic[V]):
    """Those of messages that are views of the world."""

    def __init__(
        self,
        node: Node,
        world: World,
        group: OwnThreadGroup,
        on_change: Callable[[], None],
        noun: str,
        most_points: int,
        lack: Callable[[str], str],
        worker: Worker,
    ) -> None:
        """Call ``on_change`` when a subscription is replaced by another.

        A cloud has ``most_points`` at most; ``lack`` says which of a group's kernels are missing;
        ``worker`` looks at messages.
        """
        super().__init__(node, world, group, on_change, noun)
        self._most_points, self._lack = most_points, lack
        self._worker = worker

    @property
    def news(self) -> list[str]:
        """The sources for which the last update began or ended a look at a message."""
        return [name for name, channel in self._channels.open.items() if channel.has_news]

    def collect(self, limits: TimeLimits) -> tuple[set[str], int | None]:
        """As all sensors' inputs do."""
        for channel in self._channels:
            channel.has_news = False
        return super().collect(limits)

    def _wanted(self) -> Iterable[str]:
        is_depth = self.noun == DEPTH_IMAGES
        wanted = [each for each in self._senders() if (each.depth is not None) == is_depth]
        needing = {each.name for each in wanted if self._needs_kernels(each)}
        missing = needing if needing and self._lack(KERNELS) else set[str]()
        filling = {each.name for each in wanted if self._fills_grid(each)}
        if filling and self._lack(_GRID_KERNELS):
            missing |= filling
        return [each.name for each in wanted if each.name not in missing]

    def _fills_grid(self, record: SourceRecord) -> bool:
        """Tell whether a sensor's messages fill a voxel grid."""
        filled = self._world.records.get(record.filled)
        return filled is not None and filled.fills_voxels

    def _needs_kernels(self, record: SourceRecord) -> bool:
        """Tell whether a sensor's messages are filtered, or clear what they see through."""
        its = record.sensor
        if its is None:
            return False
        has_robots = any(each.robot is not None for each in self._world.records.values())
        filters = has_robots if its.remove is None else bool(its.remove)
        return its.remembers or filters or isinstance(its, DepthSettings)


class PointInputs(_ViewInputs["PointChannel"]):
    """All subscriptions of the node to points."""

    def _make(self, record: SourceRecord) -> PointChannel:
        from scene_graph_ros.node.world.point_channel import PointChannel

        channel = PointChannel(record, Intake(record.name, self._warn), self._most_points)
        channel.look_in(self._worker)
        return channel


class DepthInputs(_ViewInputs["DepthChannel"]):
    """All subscriptions of the node to images of depth."""

    def _make(self, record: SourceRecord) -> DepthChannel:
        from scene_graph_ros.node.world.depth_channel import DepthChannel

        channel = DepthChannel(record, Intake(record.name, self._warn), self._most_points)
        channel.look_in(self._worker)
        return channel


class InfoInputs(_SensorInputs["InfoChannel"]):
    """All subscriptions of the node to lenses of such images."""

    def _wanted(self) -> Iterable[str]:
        return [each.name for each in self._senders() if each.depth is not None]

    def _make(self, record: SourceRecord) -> InfoChannel:
        from scene_graph_ros.node.world.depth_channel import InfoChannel

        return InfoChannel(record, Intake(record.name, self._warn))
