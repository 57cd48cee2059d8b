"""Topics of sources: subscribed to where they are wanted, and each failing for itself."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Generic, Protocol, TypeVar

from rclpy.node import Node

from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.node.runtime.loop import OwnThreadGroup
from scene_graph_ros.node.runtime.raw_topics import RawTopic, RawTopics
from scene_graph_ros.node.world.intake import Intake
from scene_graph_ros.node.world.scene import SourceRecord

__all__ = ["Channels"]


class SourceTopic(RawTopic, Protocol):
    """The topic of a source, and what judges its messages."""

    record: SourceRecord
    intake: Intake


C = TypeVar("C", bound=SourceTopic)


class Channels(Generic[C]):
    """The channels of one kind by the name of their source.

    To be changed by the thread that waits for the messages, or while it does not run; safe to
    read from any thread.
    """

    def __init__(
        self,
        node: Node,
        group: OwnThreadGroup,
        on_change: Callable[[], None],
        *,
        make: Callable[[SourceRecord], C],
        noun: str,
        queued: int,
    ) -> None:
        """Make channels for ``noun``; the middleware holds ``queued`` messages of each.

        ``on_change`` is called when a subscription is replaced by another.
        """
        self._report = node.get_logger().error
        self._topics = RawTopics(node, group, on_change)
        self._make, self._noun, self._queued = make, noun, queued
        self._open: dict[str, C] = {}
        self._failures: dict[str, str] = {}

    @property
    def open(self) -> Mapping[str, C]:
        """The channels that are open."""
        return dict(self._open)

    @property
    def failures(self) -> Mapping[str, str]:
        """Why the channels are not open that should be."""
        return dict(self._failures)

    def follow(self, wanted: Mapping[str, SourceRecord]) -> None:
        """Have a channel for each of these sources, and for no other."""
        for name, channel in self.open.items():
            if wanted.get(name) is not channel.record:
                self._topics.unsubscribe(self._open.pop(name))
        for name in self._failures.keys() - wanted.keys():
            del self._failures[name]
        for name, record in wanted.items():
            if name not in self._open:
                self._try(name, record)

    def close(self) -> None:
        """Unsubscribe from everything."""
        self.follow({})

    def _try(self, name: str, record: SourceRecord) -> None:
        try:
            channel = self._make(record)
            self._topics.subscribe(channel, self._queued)
        except Exception as error:  # noqa: BLE001 - one source's topic never costs another's
            reason = f"{type(error).__name__}: {quoted(str(error))}"
            if self._failures.get(name) != reason:
                self._failures[name] = reason
                self._report(f"source {quoted(name)}: no {self._noun} can be received: {reason}")
            return
        self._failures.pop(name, None)
        self._open[name] = channel

    def __iter__(self) -> Iterator[C]:
        return iter(self.open.values())
