"""Topics of points: one subscription per source that has a cloud."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING

from rclpy.node import Node

from scene_graph_ros.node.runtime.loop import OwnThreadGroup
from scene_graph_ros.node.world.intake import Intake
from scene_graph_ros.node.world.scene import SourceRecord
from scene_graph_ros.node.world.source_channel import Inputs
from scene_graph_ros.node.world.world import World

if TYPE_CHECKING:
    from scene_graph_ros.node.world.clouds import SourceClouds
    from scene_graph_ros.node.world.point_channel import PointChannel

__all__ = ["PointInputs"]

_QUEUED = 2
"""Messages that the middleware may hold per source."""


class PointInputs(Inputs["PointChannel"]):
    """All subscriptions of the node to points."""

    def __init__(
        self,
        node: Node,
        world: World,
        group: OwnThreadGroup,
        on_change: Callable[[], None],
        most_points: int,
    ) -> None:
        """Call ``on_change`` when a subscription is replaced by another.

        A message has ``most_points`` at most.
        """
        super().__init__(node, world, group, on_change, noun="points", queued=_QUEUED)
        self._most_points = most_points

    def _wanted(self) -> Iterable[str]:
        snapshot = self._world.snapshot
        return [name for name in snapshot.sensing if snapshot.records[name].depth is None]

    def _target(self, name: str) -> SourceClouds | None:
        return self._world.clouds.get(name)

    def _make(self, record: SourceRecord) -> PointChannel:
        from scene_graph_ros.node.world.point_channel import PointChannel

        return PointChannel(record, Intake(record.name, self._warn), self._most_points)
