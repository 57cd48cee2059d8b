"""Configuration topics: one subscription per source that has deformable geometry."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, TYPE_CHECKING

from rclpy.node import Node

from scene_graph_ros.node.intake import Intake, TimeLimits
from scene_graph_ros.node.loop import OwnThreadGroup
from scene_graph_ros.node.raw_topics import RawTopics
from scene_graph_ros.node.scene import SourceRecord
from scene_graph_ros.node.world import World

if TYPE_CHECKING:
    from scene_graph_ros.node.configurations import ConfigurationChannel

__all__ = ["ConfigurationInputs"]

_QUEUED = 16
"""Messages that the middleware may hold per source."""


class ConfigurationInputs:
    """All configuration subscriptions of the node."""

    def __init__(
        self, node: Node, world: World, group: OwnThreadGroup, on_change: Callable[[], None]
    ) -> None:
        """Call ``on_change`` when there are other subscriptions."""
        self._world = world
        self._logger = node.get_logger()
        self._topics = RawTopics(node, group, on_change)
        self._on_change = on_change
        self._channels: dict[str, ConfigurationChannel] = {}

    @property
    def channels(self) -> Mapping[str, Any]:
        """Channels by name of the source; each has ``topic``, ``record`` and ``intake``."""
        return dict(self._channels)

    def refresh(self) -> None:
        """Subscribe for sources that have deformable geometry now, unsubscribe for others."""
        wanted = {name: self._world.records[name] for name in self._world.deformables}
        if not wanted and not self._channels:
            return
        for name, channel in list(self._channels.items()):
            if wanted.get(name) != channel.record:
                self._topics.unsubscribe(self._channels.pop(name))
        for name, record in wanted.items():
            if name not in self._channels:
                self._channels[name] = self._open(record)
        self._on_change()

    def close(self) -> None:
        """Unsubscribe from everything."""
        for channel in self._channels.values():
            self._topics.unsubscribe(channel)
        self._channels.clear()

    def discard(self) -> None:
        """Forget messages that have not been applied yet."""
        for channel in list(self._channels.values()):
            channel.take()

    def collect(self, limits: TimeLimits) -> tuple[set[str], int | None]:
        """Write what has arrived into the world's deformables; hold the world's lock.

        Returns the sources that deformed something and the steady time when the oldest applied
        message arrived.
        """
        deformed, arrivals = set(), []
        for name, channel in list(self._channels.items()):
            kept, deformables = channel.take(), self._world.deformables.get(name)
            if not kept or deformables is None:
                continue
            arrival = channel.apply(kept, deformables, limits)
            if arrival is not None:
                deformed.add(name)
                arrivals.append(arrival)
        return deformed, min(arrivals, default=None)

    def _open(self, record: SourceRecord) -> ConfigurationChannel:
        from scene_graph_ros.node.configurations import ConfigurationChannel

        intake = Intake(record.name, self._logger.warning, noun="geometry")
        channel = ConfigurationChannel(record, intake, self._world.world_frame)
        self._topics.subscribe(channel, _QUEUED)
        return channel
