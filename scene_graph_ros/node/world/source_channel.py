"""The topic of a source: messages stay bytes until the next update, and are judged then.

What is the same for poses and for configurations of deformable geometry.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from rclpy.node import Node
from rclpy.serialization import deserialize_message

from msg_adapters.errors import MessageError
from scene_graph_ros.geometry.errors import SceneGraphError
from scene_graph_ros.node.runtime.loop import OwnThreadGroup
from scene_graph_ros.node.world.channels import Channels
from scene_graph_ros.node.world.intake import Fault, Intake, TimeLimits
from scene_graph_ros.node.world.message_sizes import too_long
from scene_graph_ros.node.world.scene import SourceRecord
from scene_graph_ros.node.world.world import World

__all__ = ["Inputs", "Kept", "SourceChannel", "apply_kept"]


@dataclass(eq=False, slots=True)
class Kept:
    """A message that waits for the update, and the steady time when it arrived, nanoseconds."""

    data: bytes
    arrival: int


K = TypeVar("K", bound=Kept)
T = TypeVar("T")


class SourceChannel(ABC, Generic[K, T]):
    """One topic of a source, whose messages move what the source has of one kind."""

    def __init__(self, record: SourceRecord, intake: Intake, kind: Any) -> None:
        self.record = record
        self.intake = intake
        self.kind = kind
        self.subscription: Any = None
        self.topic = ""

    @property
    @abstractmethod
    def wanted_topic(self) -> str:
        """Name of the topic, before namespaces and remapping."""

    @abstractmethod
    def store(self, data: bytes, arrival: int) -> None:
        """Keep a message that arrived at a steady time (ns)."""

    @abstractmethod
    def take(self) -> list[K]:
        """Take all messages that were kept, oldest first."""

    def apply(self, kept: list[K], target: T, limits: TimeLimits) -> int | None:
        """Apply messages; return when the oldest that moved something arrived, None if none."""
        arrival = None
        for one in kept:
            try:
                if self._apply_one(one, target, limits) and arrival is None:
                    arrival = one.arrival
            except SceneGraphError as error:
                self.intake.fault(Fault.MALFORMED, "", str(error))
        return arrival

    @abstractmethod
    def _apply_one(self, kept: K, target: T, limits: TimeLimits) -> int:
        """Apply a message; return of how many things. Raises SceneGraphError."""

    def _read(self, data: bytes, most: int) -> Any:
        """Return the message. Raises MessageError for one that is too long, or can't be read."""
        if len(data) > most:
            raise MessageError(too_long(data, most))
        try:
            return self._deserialize(data)
        except Exception as error:  # the middleware raises whatever it likes
            raise MessageError(f"a message can't be read: {error}") from error

    def _deserialize(self, data: bytes) -> Any:
        return deserialize_message(data, self.kind)


def apply_kept(
    channel: SourceChannel[Any, Any], record: SourceRecord | None, target: Any, limits: TimeLimits
) -> int | None:
    """Apply what a channel kept; return when the oldest arrived that moved something, or None.

    Where ``record`` is not the channel's any more, or there is no ``target``, it is forgotten.
    """
    kept = channel.take()
    if not kept or record is not channel.record or target is None:
        return None
    return channel.apply(kept, target, limits)


C = TypeVar("C", bound=SourceChannel[Any, Any])


class Inputs(ABC, Generic[C]):
    """All subscriptions of one kind."""

    def __init__(
        self,
        node: Node,
        world: World,
        group: OwnThreadGroup,
        on_change: Callable[[], None],
        *,
        noun: str,
        queued: int,
    ) -> None:
        """Subscribe to ``noun``; the middleware holds ``queued`` messages of each source.

        ``on_change`` is called when a subscription is replaced by another.
        """
        self._world = world
        self._warn = node.get_logger().warning
        self._channels: Channels[C] = Channels(
            node, group, on_change, make=self._make, noun=noun, queued=queued
        )

    @property
    def channels(self) -> Channels[C]:
        """The channels by name of the source."""
        return self._channels

    def refresh(self) -> None:
        """Subscribe for sources that are to have a topic now, unsubscribe for others."""
        records = self._world.snapshot.records
        self._channels.follow({name: records[name] for name in self._wanted()})

    def close(self) -> None:
        """Unsubscribe from everything."""
        self._channels.close()

    def discard(self) -> None:
        """Forget messages that have not been applied yet."""
        for channel in self._channels:
            channel.take()

    def collect(self, limits: TimeLimits) -> tuple[set[str], int | None]:
        """Write what has arrived into the world; hold the world's lock.

        Returns the sources that moved something and the steady time when the oldest applied
        message arrived.
        """
        moved, arrivals = set(), []
        records = self._world.snapshot.records
        for name, channel in self._channels.open.items():
            record = records.get(name)
            target = None if record is None else self._target(name)
            arrival = apply_kept(channel, record, target, limits)
            if arrival is not None:
                moved.add(name)
                arrivals.append(arrival)
        return moved, min(arrivals, default=None)

    @abstractmethod
    def _wanted(self) -> Iterable[str]:
        """Return the names of the sources that are to have a topic."""

    @abstractmethod
    def _target(self, name: str) -> Any:
        """Return what messages of a source are written into, None where there is nothing."""

    @abstractmethod
    def _make(self, record: SourceRecord) -> C:
        """Make the channel of a source."""
