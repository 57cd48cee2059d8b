"""Configuration topics: one subscription per source that has deformable geometry."""

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
    from scene_graph_ros.node.world.configurations import ConfigurationChannel
    from scene_graph_ros.node.world.deformables import SourceDeformables

__all__ = ["ConfigurationInputs"]

_QUEUED = 16
"""Messages that the middleware may hold per source."""


class ConfigurationInputs(Inputs["ConfigurationChannel"]):
    """All configuration subscriptions of the node."""

    def __init__(
        self, node: Node, world: World, group: OwnThreadGroup, on_change: Callable[[], None]
    ) -> None:
        """Call ``on_change`` when a subscription is replaced by another."""
        super().__init__(node, world, group, on_change, noun="configurations", queued=_QUEUED)

    def _wanted(self) -> Iterable[str]:
        return self._world.snapshot.deforming

    def _target(self, name: str) -> SourceDeformables | None:
        return self._world.deformables.get(name)

    def _make(self, record: SourceRecord) -> ConfigurationChannel:
        from scene_graph_ros.node.world.configurations import ConfigurationChannel

        intake = Intake(record.name, self._warn, noun="geometry")
        return ConfigurationChannel(record, intake, self._world.world_frame)
