"""Topics of images of depth and of their lenses: two subscriptions per source that has some."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING

from rclpy.node import Node

from scene_graph_ros.node.runtime.loop import OwnThreadGroup
from scene_graph_ros.node.world.intake import Intake
from scene_graph_ros.node.world.scene import SourceRecord
from scene_graph_ros.node.world.source_channel import Inputs
from scene_graph_ros.node.world.source_topics import CAMERA_INFO, DEPTH_IMAGES
from scene_graph_ros.node.world.time_limits import TimeLimits
from scene_graph_ros.node.world.world import World

if TYPE_CHECKING:
    from scene_graph_ros.node.world.clouds import SourceClouds
    from scene_graph_ros.node.world.depth_channel import DepthChannel, InfoChannel

__all__ = ["DepthInputs", "InfoInputs"]

_QUEUED = 2
"""Messages that the middleware may hold per source."""


KERNELS = "sensing"
"""The group that turns images into points; there is no subscription before it is compiled."""


def _wanted(world: World) -> list[str]:
    snapshot = world.snapshot
    return [n for n in snapshot.sensing if snapshot.records[n].depth is not None]


class DepthInputs(Inputs["DepthChannel"]):
    """All subscriptions of the node to images of depth."""

    def __init__(
        self,
        node: Node,
        world: World,
        group: OwnThreadGroup,
        on_change: Callable[[], None],
        most_points: int,
        lack: Callable[[str], str],
    ) -> None:
        """Call ``on_change`` when a subscription is replaced by another.

        A cloud has ``most_points`` at most; ``lack`` says which of a group's kernels are missing.
        """
        super().__init__(node, world, group, on_change, noun=DEPTH_IMAGES, queued=_QUEUED)
        self._most_points, self._lack = most_points, lack

    def collect(self, limits: TimeLimits) -> tuple[set[str], int | None]:
        """Apply images, and forget points that are too old; as `Inputs.collect`."""
        moved, arrival = super().collect(limits)
        clouds = self._world.clouds
        moved.update(
            n for n in self._channels.open if n in clouds and clouds[n].expire(limits.now)
        )
        return moved, arrival

    def _wanted(self) -> Iterable[str]:
        wanted = _wanted(self._world)
        return [] if wanted and self._lack(KERNELS) else wanted

    def _target(self, name: str) -> SourceClouds | None:
        return self._world.clouds.get(name)

    def _make(self, record: SourceRecord) -> DepthChannel:
        from scene_graph_ros.node.world.depth_channel import DepthChannel

        return DepthChannel(record, Intake(record.name, self._warn), self._most_points)


class InfoInputs(Inputs["InfoChannel"]):
    """All subscriptions of the node to lenses of such images."""

    def __init__(
        self, node: Node, world: World, group: OwnThreadGroup, on_change: Callable[[], None]
    ) -> None:
        """Call ``on_change`` when a subscription is replaced by another."""
        super().__init__(node, world, group, on_change, noun=CAMERA_INFO, queued=_QUEUED)

    def _wanted(self) -> Iterable[str]:
        return _wanted(self._world)

    def _target(self, name: str) -> SourceClouds | None:
        return self._world.clouds.get(name)

    def _make(self, record: SourceRecord) -> InfoChannel:
        from scene_graph_ros.node.world.depth_channel import InfoChannel

        return InfoChannel(record, Intake(record.name, self._warn))
