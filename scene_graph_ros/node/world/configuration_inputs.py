"""Configuration topics: one subscription per source that has deformable geometry."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from rclpy.node import Node

from scene_graph_ros.node.runtime.loop import OwnThreadGroup
from scene_graph_ros.node.world.channels import Channels
from scene_graph_ros.node.world.intake import Intake, TimeLimits
from scene_graph_ros.node.world.scene import SourceRecord
from scene_graph_ros.node.world.world import World

if TYPE_CHECKING:
    from scene_graph_ros.node.world.configurations import ConfigurationChannel

__all__ = ["ConfigurationInputs"]

_QUEUED = 16
"""Messages that the middleware may hold per source."""


class ConfigurationInputs:
    """All configuration subscriptions of the node."""

    def __init__(
        self, node: Node, world: World, group: OwnThreadGroup, on_change: Callable[[], None]
    ) -> None:
        """Call ``on_change`` when a subscription is replaced by another."""
        self._world = world
        self._warn = node.get_logger().warning
        self._channels: Channels[ConfigurationChannel] = Channels(
            node, group, on_change, make=self._make, noun="configurations", queued=_QUEUED
        )

    @property
    def channels(self) -> Channels[ConfigurationChannel]:
        """The channels by name of the source."""
        return self._channels

    def refresh(self) -> None:
        """Subscribe for sources that have deformable geometry now, unsubscribe for others."""
        snapshot = self._world.snapshot
        self._channels.follow({name: snapshot.records[name] for name in snapshot.deforming})

    def close(self) -> None:
        """Unsubscribe from everything."""
        self._channels.close()

    def discard(self) -> None:
        """Forget messages that have not been applied yet."""
        for channel in self._channels:
            channel.take()

    def collect(self, limits: TimeLimits) -> tuple[set[str], int | None]:
        """Write what has arrived into the world's deformables; hold the world's lock.

        Returns the sources that deformed something and the steady time when the oldest applied
        message arrived.
        """
        deformed, arrivals = set(), []
        records = self._world.snapshot.records
        for name, channel in self._channels.open.items():
            kept, deformables = channel.take(), self._world.deformables.get(name)
            if not kept or deformables is None or records.get(name) is not channel.record:
                continue
            arrival = channel.apply(kept, deformables, limits)
            if arrival is not None:
                deformed.add(name)
                arrivals.append(arrival)
        return deformed, min(arrivals, default=None)

    def _make(self, record: SourceRecord) -> ConfigurationChannel:
        from scene_graph_ros.node.world.configurations import ConfigurationChannel

        intake = Intake(record.name, self._warn, noun="geometry")
        return ConfigurationChannel(record, intake, self._world.world_frame)
