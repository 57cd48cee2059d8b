"""Subscriptions whose messages stay bytes, taken by the world's own thread.

A topic has a volatile reader, which hears everybody. Once a publisher offers to repeat its earlier
messages (transient local), there is a second reader that asks for these, too: so a message that
was published once is heard, also by a node that starts later.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from typing import Any, Protocol

from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from scene_graph_ros.node.runtime.loop import OwnThreadGroup
from scene_graph_ros.node.runtime.qos import overridable, pose_qos

__all__ = ["RawChannel", "RawTopics", "Reader", "TopicReaders"]

_REMEMBERED = 64
"""Messages of one reader that the other may still bring."""

_REMEMBERED_BYTES = 1 << 20


class RawChannel(Protocol):
    """The receiver of messages of one topic, or of some."""

    kind: Any
    record: Any
    noun: str

    def store(self, data: bytes, arrival: int, *, is_static: bool = False) -> None:
        """Keep a message that arrived at a steady time (ns)."""


class _Memory:
    """The messages of one reader that the other has not brought yet, the newest of them."""

    def __init__(self) -> None:
        self._messages: deque[bytes] = deque()
        self._bytes = 0

    def add(self, data: bytes) -> None:
        self._messages.append(data)
        self._bytes += len(data)
        while len(self._messages) > _REMEMBERED or self._bytes > _REMEMBERED_BYTES:
            self._bytes -= len(self._messages.popleft())

    def remove(self, data: bytes) -> bool:
        """Forget a message; tell whether it was there."""
        try:
            self._messages.remove(data)
        except ValueError:
            return False
        self._bytes -= len(data)
        return True


class Reader:
    """One subscription to a topic."""

    def __init__(self, readers: TopicReaders) -> None:
        self.readers = readers
        self.subscription: Any = None
        self.memory = _Memory()

    @property
    def topic(self) -> str:
        """Absolute name of the topic."""
        return self.readers.topic

    @property
    def channel(self) -> RawChannel:
        """The receiver of the messages."""
        return self.readers.channel

    @property
    def is_static(self) -> bool:
        """Whether the messages are static now."""
        return self.readers.is_static

    def counts(self, data: bytes) -> bool:
        """Tell whether the topic's other reader has not brought this message already."""
        for other in self.readers:
            if other is not self and other.memory.remove(data):
                return False
        self.memory.add(data)
        return True

    def store(self, data: bytes, arrival: int) -> None:
        """Hand a message on."""
        self.channel.store(data, arrival, is_static=self.is_static)


class TopicReaders:
    """The readers of one topic of a channel.

    ``is_static`` tells whether its messages hold for good: always, or where every publisher
    repeats its last message to later subscribers.
    """

    def __init__(self, channel: RawChannel, wanted: str, *, is_always_static: bool) -> None:
        self.channel, self.wanted = channel, wanted
        self.topic = ""
        self.is_static = self._is_always_static = is_always_static
        self.first = Reader(self)
        self.latched: Reader | None = None
        self.is_to_be_seen = False
        """Whether somebody came or went who was not looked at yet."""

    def __iter__(self) -> Iterator[Reader]:
        return iter([self.first] if self.latched is None else [self.first, self.latched])

    def offered(self, durabilities: list[Any]) -> bool:
        """Note the publishers' offers; tell whether one of them repeats earlier messages."""
        latched = [each == DurabilityPolicy.TRANSIENT_LOCAL for each in durabilities]
        if latched:
            self.is_static = self._is_always_static or all(latched)
        return any(latched)


def _never(data: bytes) -> None:
    raise AssertionError("the world's own thread takes these messages")


class RawTopics:
    """Subscribes; takes messages of best effort publishers where there are no others.

    To be used by the thread that waits for the messages, or while it does not run.
    """

    def __init__(self, node: Node, group: OwnThreadGroup, on_change: Callable[[], None]) -> None:
        """Call ``on_change`` when there is another subscription."""
        self._node = node
        self._group = group
        self._on_change = on_change

    def subscribe(
        self, channel: RawChannel, wanted: str, depth: int, *, is_static: bool
    ) -> TopicReaders:
        """Subscribe to a topic; the middleware holds ``depth`` messages until they are taken."""
        readers = TopicReaders(channel, wanted, is_always_static=is_static)
        self._subscribe(readers.first, pose_qos(depth), overridable())
        return readers

    def unsubscribe(self, readers: TopicReaders) -> None:
        """End the subscriptions to a topic."""
        for reader in readers:
            if reader.subscription is not None:
                self._node.destroy_subscription(reader.subscription)

    def look(self, readers: TopicReaders) -> None:
        """Look at publishers that came or went since, and ask for their earlier messages."""
        if not readers.is_to_be_seen:
            return
        infos = self._node.get_publishers_info_by_topic(readers.topic)
        # Publishers are known to match before they are known by what they offer.
        readers.is_to_be_seen = len(infos) < readers.first.subscription.get_publisher_count()
        profiles = [info.qos_profile for info in infos]
        if readers.offered([p.durability for p in profiles]) and readers.latched is None:
            first = readers.first.subscription.qos_profile
            if first.durability == DurabilityPolicy.TRANSIENT_LOCAL:
                return
            latched = Reader(readers)
            self._subscribe(latched, pose_qos(first.depth, is_latched=True))
            readers.latched = latched
            self._on_change()

    def _subscribe(self, reader: Reader, qos: QoSProfile, options: Any = None) -> None:
        readers = reader.readers
        is_first = reader is readers.first
        reader.subscription = self._node.create_subscription(
            readers.channel.kind,
            readers.wanted,
            _never,
            qos,
            callback_group=self._group,
            event_callbacks=SubscriptionEventCallbacks(
                # The second reader fits those only who repeat what they sent, as it should.
                incompatible_qos=lambda event: self._on_incompatible(reader) if is_first else None,
                matched=lambda event: self._on_matched(readers),
            ),
            raw=True,
            qos_overriding_options=options,
        )
        readers.topic = reader.subscription.topic_name

    def _on_matched(self, readers: TopicReaders) -> None:
        readers.is_to_be_seen = True
        self.look(readers)

    def _on_incompatible(self, reader: Reader) -> None:
        """Take a best effort publisher's messages; warn where that does not help either."""
        logger, topic = self._node.get_logger(), reader.topic
        old = reader.subscription
        if old.qos_profile.reliability == ReliabilityPolicy.BEST_EFFORT:
            logger.warning(f"{topic}: a publisher's quality of service does not fit")
            return
        logger.info(f"{topic}: a publisher offers best effort only, so that is taken")
        self._subscribe(reader, pose_qos(old.qos_profile.depth, is_reliable=False))
        self._node.destroy_subscription(old)
        self._on_change()
