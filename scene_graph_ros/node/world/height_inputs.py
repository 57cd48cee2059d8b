"""Topics of heights: one subscription per source that has a height field."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING

from rclpy.node import Node

from scene_graph_ros.node.runtime.loop import OwnThreadGroup
from scene_graph_ros.node.world.intake import Intake
from scene_graph_ros.node.world.scene import SourceRecord
from scene_graph_ros.node.world.source_channel import Inputs
from scene_graph_ros.node.world.source_topics import HEIGHTS
from scene_graph_ros.node.world.world import World

if TYPE_CHECKING:
    from scene_graph_ros.node.world.fields import SourceFields
    from scene_graph_ros.node.world.height_channel import HeightChannel

__all__ = ["HeightInputs"]

_QUEUED = 2
"""Messages that the middleware may hold per source."""


class HeightInputs(Inputs["HeightChannel"]):
    """All subscriptions of the node to heights."""

    def __init__(
        self, node: Node, world: World, group: OwnThreadGroup, on_change: Callable[[], None]
    ) -> None:
        """Call ``on_change`` when a subscription is replaced by another."""
        super().__init__(node, world, group, on_change, noun=HEIGHTS, queued=_QUEUED)

    def _wanted(self) -> Iterable[str]:
        return self._world.snapshot.with_fields

    def _target(self, name: str) -> SourceFields | None:
        return self._world.fields.get(name)

    def _make(self, record: SourceRecord) -> HeightChannel:
        from scene_graph_ros.node.world.height_channel import HeightChannel

        return HeightChannel(record, Intake(record.name, self._warn))
