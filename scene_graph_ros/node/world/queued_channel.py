"""Messages of a source that wait for the update as bytes; which of them are read then.

Of messages with the same names, and the same of all else but stamps and numbers, only the newest
is read; messages with other names are read beside it, so that partial ones are never lost. They
are read by the layout of their bytes where that is known, else by the ordinary deserializer.
"""

from __future__ import annotations

from abc import abstractmethod
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
import threading
from typing import Any

from rclpy.serialization import serialize_message

from msg_adapters.wire.pose_kinds import POSE_KINDS
from msg_adapters.wire.poses import Layout, PoseWire
from scene_graph_ros.node.world.intake import Intake, SourceFrames
from scene_graph_ros.node.world.message_sizes import most_bytes
from scene_graph_ros.node.world.scene import SourceRecord
from scene_graph_ros.node.world.source_channel import Kept, SourceChannel
from scene_graph_ros.node.world.time_limits import TimeLimits

__all__ = ["QUEUED", "QueuedChannel", "Reading"]

QUEUED = 64
"""Messages of unknown layout kept per source; also how many the middleware may hold."""

_QUEUED_BYTES = 1 << 18
"""Their bytes together, unless one has more: to read them takes a tenth of a second."""

_UNSORTED_BYTES = 1 << 22
"""Bytes that may arrive of a source before those that need not be read are dropped."""


@dataclass(eq=False, slots=True)
class Reading(Kept):
    """A message whose layout was looked for; None where it is not known."""

    layout: Layout | None
    is_good: bool | None = None
    """Whether there is nothing against any of its numbers; None before it was looked at."""

    def is_clean(self) -> bool:
        """Tell whether its layout is known, and nothing is against any of its numbers."""
        if self.is_good is None:
            self.is_good = self.layout is not None and self.layout.is_clean(self.data)
        return self.is_good


class _ToRead:
    """Which of some messages are to be read: those that no other one supersedes."""

    def __init__(self, supersedes: Callable[[Reading, Reading], bool], queued: int) -> None:
        self._supersedes = supersedes
        self._most, self._most_bytes = queued, _QUEUED_BYTES * queued // QUEUED
        self._newest: dict[Layout, Reading] = {}
        self._loose: deque[Reading] = deque()
        self._loose_bytes = 0
        self.readings: dict[Reading, None] = {}
        self.dropped = 0

    def add(self, reading: Reading) -> None:
        """Take a message, which came after the others."""
        layout = reading.layout
        if layout is not None:
            older = self._newest.get(layout)
            if older is None or self._supersedes(reading, older):
                self._newest[layout] = reading
                if older is not None:
                    self._drop(older)
                self.readings[reading] = None
                return
        # Not known, faulty or out of order: to be looked at for itself.
        self._make_room(len(reading.data))
        self._loose.append(reading)
        self._loose_bytes += len(reading.data)
        self.readings[reading] = None

    def _make_room(self, size: int) -> None:
        """Drop the oldest messages of unknown layout that are too many, or too long together."""
        while self._loose and (
            len(self._loose) == self._most or self._loose_bytes + size > self._most_bytes
        ):
            oldest = self._loose.popleft()
            self._loose_bytes -= len(oldest.data)
            self._drop(oldest)

    def _drop(self, reading: Reading) -> None:
        del self.readings[reading]
        self.dropped += 1


class QueuedChannel(SourceChannel[Reading, SourceFrames]):
    """Messages of one type of a source, which move frames of it."""

    queued = QUEUED
    """Messages that none supersedes kept between two updates."""

    def __init__(self, record: SourceRecord, intake: Intake, kind: Any, type_name: str) -> None:
        super().__init__(record, intake, kind)
        self._wire: PoseWire | None = None
        if type_name in POSE_KINDS:
            self._wire = PoseWire(type_name, serialize_message)
        self._lock = threading.Lock()
        self._begin()
        self._frames: SourceFrames | None = None

    def _begin(self) -> None:
        """Have no messages, and room for some."""
        self._kept: list[Kept] = []
        self._bytes = 0
        self._most, self._most_bytes = self.queued, _UNSORTED_BYTES

    def store(self, data: bytes, arrival: int, *, is_static: bool = False) -> None:
        """Keep a message that arrived at a steady time (ns); it is looked at in the update."""
        self.intake.statistics.arrived(arrival, is_static=is_static)
        with self._lock:
            self._kept.append(Kept(data, arrival, is_static))
            self._bytes += len(data)
            if len(self._kept) >= self._most or self._bytes > self._most_bytes:
                self._drop_superseded()

    def _drop_superseded(self) -> None:
        """Keep messages worth reading alone, and have room for as many more."""
        self._kept = list(self._worth_reading(self._kept))
        self._bytes = sum(len(message.data) for message in self._kept)
        self._most = max(self.queued, 2 * len(self._kept))
        self._most_bytes = max(_UNSORTED_BYTES, 2 * self._bytes)

    def take(self) -> list[Kept]:
        """Take all messages that were kept, oldest first."""
        with self._lock:
            taken = self._kept
            if taken:
                self._begin()
        return taken

    def _worth_reading(self, kept: list[Kept]) -> list[Reading]:
        """Return the messages to be read, and count the others."""
        if len(kept) == 1:
            return [self._reading(kept[0])]
        to_read = _ToRead(self._supersedes, self.queued)
        for message in kept:
            to_read.add(self._reading(message))
        self.intake.statistics.superseded += to_read.dropped
        return list(to_read.readings)

    def _reading(self, message: Kept) -> Reading:
        if isinstance(message, Reading):
            return message
        data = message.data
        layout = None if self._wire is None else self._wire.find(data)
        if layout is not None:
            self._heard(layout.names, message.arrival)
        return Reading(data, message.arrival, message.is_static, layout)

    def forget(self, after: int) -> None:
        """Forget messages that are stamped later (ns) and not part of the world."""

    def _heard(self, names: tuple[str, ...], arrival: int) -> None:
        """Take note that these were named by a message that arrived at a steady time (ns)."""

    def _supersedes(self, newer: Reading, older: Reading) -> bool:
        """Tell whether nothing is lost without ``older``, which has the same layout.

        A faulty message is not dropped, so that it is counted, and drops nothing, so that the
        good poses before it hold.
        """
        layout, frames = newer.layout, self._frames
        assert layout is not None
        if frames is None or 0 < layout.stamp(newer.data) < layout.stamp(older.data):
            return False
        return self._takes_all(layout, frames) and newer.is_clean() and older.is_clean()

    @abstractmethod
    def _takes_all(self, layout: Layout, frames: SourceFrames) -> bool:
        """Tell whether nothing but numbers and stamps can be wrong with messages of a layout.

        False where older ones count beside newer ones.
        """

    def _apply_one(self, kept: Reading, frames: SourceFrames, limits: TimeLimits) -> int:
        self._frames = frames
        layout = kept.layout
        if layout is not None and layout.has_times(kept.data):
            return self._apply_layout(kept, layout, frames, limits)
        message = self._read(kept.data, most_bytes(self._count_known(frames)))
        applied = self._apply_message(kept, message, frames, limits)
        if self._wire is not None:
            self._wire.learn(kept.data, message)
        return applied

    def _count_known(self, frames: SourceFrames) -> int:
        """Return the number of names that a message may have."""
        return len(frames.names)

    @abstractmethod
    def _apply_layout(
        self, kept: Reading, layout: Layout, frames: SourceFrames, limits: TimeLimits
    ) -> int:
        """Apply a message of a known layout; return of how many things."""

    @abstractmethod
    def _apply_message(
        self, kept: Reading, message: Any, frames: SourceFrames, limits: TimeLimits
    ) -> int:
        """Apply a message that was read the ordinary way; return of how many things."""
