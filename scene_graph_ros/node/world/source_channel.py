"""Topics of sources: messages stay bytes until the next update, and are judged then.

The common part of poses and configurations of deformable geometry.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Generic, TypeVar

from rclpy.node import Node
from rclpy.serialization import deserialize_message

from msg_adapters.errors import MessageError
from scene_graph_ros.geometry.errors import SceneGraphError
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.node.runtime.loop import OwnThreadGroup
from scene_graph_ros.node.runtime.raw_topics import RawTopics, Reader, TopicReaders
from scene_graph_ros.node.world.faults import Fault
from scene_graph_ros.node.world.intake import Intake
from scene_graph_ros.node.world.message_sizes import too_long
from scene_graph_ros.node.world.scene import SourceRecord
from scene_graph_ros.node.world.time_limits import TimeLimits
from scene_graph_ros.node.world.world import World

__all__ = ["Channels", "Inputs", "Kept", "SourceChannel", "apply_kept"]


@dataclass(eq=False, slots=True)
class Kept:
    """A message that waits for the update, and the steady time when it arrived, nanoseconds."""

    data: bytes
    arrival: int
    is_static: bool
    """Whether what it says is static: the message of who says it once."""


K = TypeVar("K", bound=Kept)
T = TypeVar("T")


class SourceChannel(ABC, Generic[K, T]):
    """Messages of one type of a source, which move one kind of its objects."""

    noun = "poses"
    """The word for what comes; of each source there is one channel for it."""

    def __init__(self, record: SourceRecord, intake: Intake, kind: Any) -> None:
        self.record = record
        self.intake = intake
        self.kind = kind
        self.readers: list[TopicReaders] = []
        self.newest: dict[str, Any] = {}
        """Entries of the diagnostics about the newest message; a new dict with each."""

    @property
    @abstractmethod
    def wanted_topics(self) -> Mapping[str, bool]:
        """Names of the topics, before namespaces and remapping, and whether each is static."""

    @property
    def topic(self) -> str:
        """Absolute name of the first topic, once it is subscribed to."""
        return self.readers[0].topic if self.readers else ""

    @abstractmethod
    def store(self, data: bytes, arrival: int, *, is_static: bool = False) -> None:
        """Keep a message that arrived at a steady time (ns)."""

    @abstractmethod
    def take(self) -> list[Kept]:
        """Take all messages that were kept, oldest first."""

    noted: Callable[[str], object] | None = None
    """Called with the source after each message that moved something, if all of them matter: each
    is a moment between which others are interpolated."""

    def has_result(self) -> bool:
        """Tell whether something of an earlier message is to be applied."""
        return False

    @abstractmethod
    def _worth_reading(self, kept: list[Kept]) -> Sequence[K]:
        """Return the messages to be read, and count the others."""

    def apply(self, kept: list[Kept], target: T, limits: TimeLimits) -> int | None:
        """Apply messages; return when the oldest that moved something arrived, None if none."""
        arrival = None
        for one in self._worth_reading(kept):
            try:
                if self._apply_one(one, target, limits):
                    arrival = one.arrival if arrival is None else arrival
                    if self.noted is not None:
                        self.noted(self.record.name)
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
    channel: SourceChannel[Any, T],
    record: SourceRecord | None,
    target: Callable[[], T | None],
    limits: TimeLimits,
) -> int | None:
    """Apply a channel's messages; return when the oldest arrived that moved something, or None.

    Where ``record`` is not the channel's any more, or there is no ``target()``, it is forgotten.
    """
    kept = channel.take()
    if not (kept or channel.has_result()) or record is not channel.record:
        return None
    found = target()
    return None if found is None else channel.apply(kept, found, limits)


C = TypeVar("C", bound=SourceChannel[Any, Any])


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
        is_same: Callable[[SourceRecord, SourceRecord], bool],
        noun: str,
        queued: int,
    ) -> None:
        """Make channels for ``noun``; the middleware holds ``queued`` messages of each.

        One stays while ``is_same`` tells that its source's record, and the one now, are as good.

        ``on_change`` is called when a subscription is replaced by another.
        """
        self._report = node.get_logger().error
        self._topics = RawTopics(node, group, on_change)
        self._make, self._noun, self._queued = make, noun, queued
        self._is_same = is_same
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
            if name not in wanted or not self._is_same(channel.record, wanted[name]):
                self._unsubscribe(self._open.pop(name))
        for name in self._failures.keys() - wanted.keys():
            del self._failures[name]
        for name, record in wanted.items():
            if name not in self._open:
                self._try(name, record)

    def close(self) -> None:
        """Unsubscribe from everything."""
        self.follow({})

    def look(self) -> None:
        """Look at the publishers that came or went since."""
        for channel in self._open.values():
            for readers in channel.readers:
                self._topics.look(readers)

    def _subscribe(self, channel: C) -> None:
        try:
            for wanted, is_static in channel.wanted_topics.items():
                channel.readers.append(
                    self._topics.subscribe(channel, wanted, self._queued, is_static=is_static)
                )
        except BaseException:
            self._unsubscribe(channel)
            raise

    def _unsubscribe(self, channel: C) -> None:
        for readers in channel.readers:
            self._topics.unsubscribe(readers)
        channel.readers.clear()

    def _try(self, name: str, record: SourceRecord) -> None:
        try:
            channel = self._make(record)
            self._subscribe(channel)
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
        self._noun = noun
        self._warn = node.get_logger().warning
        self._channels: Channels[C] = Channels(
            node,
            group,
            on_change,
            make=self._make,
            is_same=self._is_same,
            noun=noun,
            queued=queued,
        )

    @property
    def noun(self) -> str:
        """The word for the messages' content."""
        return self._noun

    @property
    def channels(self) -> Channels[C]:
        """The channels by name of the source."""
        return self._channels

    @property
    def readers(self) -> list[Reader]:
        """All subscriptions."""
        return [r for channel in self._channels for readers in channel.readers for r in readers]

    def look(self) -> None:
        """Look at the publishers that came or went since."""
        self._channels.look()

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
        """Write messages that have arrived into the world; hold the world's lock.

        Returns the sources that moved something and the steady time when the oldest applied
        message arrived.
        """
        moved, arrivals = set(), []
        records = self._world.snapshot.records
        for name, channel in self._channels.open.items():
            target = partial(self._target, name)
            arrival = apply_kept(channel, records.get(name), target, limits)
            if arrival is not None:
                moved.add(name)
                arrivals.append(arrival)
        return moved, min(arrivals, default=None)

    @abstractmethod
    def _wanted(self) -> Iterable[str]:
        """Return the names of the sources that are to have a topic."""

    def _is_same(self, old: SourceRecord, new: SourceRecord) -> bool:
        """Tell whether a channel of a source goes on though its record may be another."""
        return old is new

    @abstractmethod
    def _target(self, name: str) -> Any:
        """Return the target of a source's messages, None where there is nothing."""

    @abstractmethod
    def _make(self, record: SourceRecord) -> C:
        """Make the channel of a source."""
