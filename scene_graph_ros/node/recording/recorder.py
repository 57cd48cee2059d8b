"""The recorder of a node: its inputs, the order of its updates and edits, its outputs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
import threading
import time
from typing import Any

from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.serialization import deserialize_message, serialize_message

from msg_adapters.definitions import kind_of, layout_of
from scene_graph_ros.geometry.model.ids import SourceId
from scene_graph_ros.node.recording.events import encode, EVENTS, text_of, VERSION
from scene_graph_ros.node.recording.spool import Spool
from scene_graph_ros.node.runtime.names import (
    CAMERAS,
    CONTACT_MARKERS,
    CONTACT_SURFACE_MARKERS,
    CONTACT_SURFACE_POINTS,
    CONTACTS,
    TRANSFORMS,
)
from scene_graph_ros.node.runtime.raw_topics import Reader
from scene_graph_ros.node.world.description_channel import DESCRIPTIONS
from scene_graph_ros.node.world.scene import SourceRecord
from scene_graph_ros.node.world.time_limits import TimeLimits
from scene_graph_ros.node.world.world import World, WorldSnapshot

__all__ = ["Recorder", "Tape"]

_KEY_PERIOD = 5.0
"""Seconds between whole scenes, where a viewer can begin."""

_SAMPLES = (CONTACTS, CONTACT_MARKERS, CONTACT_SURFACE_MARKERS, CONTACT_SURFACE_POINTS)
_MOST_SAMPLE = 1 << 22
"""Bytes of a message on one of these topics, 4 MiB: some ten thousand contacts. All pairs of
bodies may touch, and the rest of the recording would be lost for them."""

_SECRET = {"browser_token"}
"""Parameters that a recording does not have."""


LeaveOut = Callable[[str, int], bool]
"""Tells whether a message on a topic, of so many bytes, is not recorded."""


class Tape:
    """Takes the messages of one topic that the node publishes; a reader like any other."""

    def __init__(
        self,
        spool: Spool,
        kind: Any,
        topic: str,
        qos: QoSProfile,
        leave_out: LeaveOut | None = None,
    ) -> None:
        """``leave_out`` is asked about each message."""
        self._spool, self._topic, self._qos = spool, topic, qos
        self._leave_out = leave_out
        self._kind = kind_of(kind)
        self._key_at = float("-inf")

    def is_heard(self) -> bool:
        """Tell whether the recording goes on."""
        return self._spool.is_open

    def take_key(self) -> bool:
        """Tell whether the next message had better be the whole scene."""
        now = time.monotonic()
        if not self._spool.is_open or now - self._key_at < _KEY_PERIOD:
            return False
        self._key_at = now
        return True

    def has_newcomers(self) -> bool:
        """Tell that a message need not come earlier for it."""
        return False

    def take_missed(self) -> bool:
        """Tell that it has all messages, or says itself that some were lost."""
        return False

    def close(self) -> None:
        """Do nothing: the recording goes on."""

    def write(self, data: bytes) -> None:
        """Take a serialized message."""
        if self._leave_out is None or not self._leave_out(self._topic, len(data)):
            self._spool.put(self._topic, self._kind, data, qos=self._qos)


class Recorder:
    """Records one life of the node, from its configuration to its end.

    Methods that say so are called with the world's lock held: their records have the order in
    which the world went through them.
    """

    def __init__(self, node: Node, folder: str, most_bytes: int) -> None:
        """Begin; raises OSError where ``folder`` exists or can't be made."""
        self._events = node.resolve_topic_name(EVENTS)
        told = node.get_logger().error
        self._spool = Spool(Path(folder), self._events, most_bytes, told)
        self._lock = threading.Lock()
        self._seen: dict[tuple[str, str, str], Any] = {}
        self._first: dict[str, Any] = {}
        self._has_inputs = False
        self._sequence = -1
        self.folder = folder

    def begin(self, parameters: Mapping[str, Any], scene: tuple[str, str], given: bool) -> None:
        """Record the node's start, before it makes its world.

        ``scene`` is the file it loads and its text, ``given`` whether a program made the model.
        """
        kept = {name: value for name, value in parameters.items() if name not in _SECRET}
        path, text = scene
        self._event(
            "begin",
            version=VERSION,
            id=self.next_id(),
            parameters=kept,
            path=path,
            text=text,
            given=given,
        )

    def next_id(self) -> int:
        """Return the number after which ids are given out from now on."""
        return SourceId.get_new_id().get_value()

    def tape(self, kind: Any, name: str, topic: str, qos: QoSProfile) -> Tape | None:
        """Return the tape for the messages of a topic, called ``name`` before it was resolved.

        None for images and clouds of cameras, which can be made again from the rest.
        """
        if name == TRANSFORMS or name.startswith(CAMERAS):
            return None
        return Tape(self._spool, kind, topic, qos, self._leaves_out if name in _SAMPLES else None)

    def _leaves_out(self, topic: str, size: int) -> bool:
        """Leave out contacts where these are too many, and say so in the recording."""
        if size > _MOST_SAMPLE:
            self._event("left_out", topic=topic, bytes=size)
        return size > _MOST_SAMPLE

    def received(self, reader: Reader, data: bytes, world: World) -> None:
        """Take a message that came in, in the thread that updates the world."""
        channel = reader.channel
        if channel.noun == DESCRIPTIONS:
            # What becomes of it is an edit.
            return
        record: SourceRecord = channel.record
        if world.records.get(record.name) is not channel.record:
            # The source is gone or another: the update does not look at it.
            return
        kind = kind_of(channel.kind)
        key, topic = (record.name, channel.noun), reader.topic
        told = (channel, reader.is_static)
        if self._seen.get((*key, topic)) != told:
            self._seen[*key, topic] = told
            source, noun = key
            self._event("channel", source=source, noun=noun, topic=topic, static=reader.is_static)
        self._has_inputs = True
        if self._first.setdefault(topic, key) == key:
            self._spool.put(topic, kind, data)
        else:
            # Another source has it on its topic already.
            source, noun = key
            self._event("input", source=source, noun=noun, topic=topic, data=text_of(data))

    def updated(
        self,
        limits: TimeLimits,
        snapshot: WorldSnapshot,
        looked: Iterable[tuple[str, str]] = (),
    ) -> None:
        """Record that all inputs so far were taken; with the world's lock held.

        ``looked`` are sources and nouns of the sensors' messages, the look at which began or ended
        in this update.
        """
        looked = list(looked)
        if not (self._has_inputs or looked) and snapshot.sequence == self._sequence:
            return
        self._has_inputs, self._sequence = False, snapshot.sequence
        self._event("update", limits=list(limits), sequence=snapshot.sequence, looked=looked)

    def edited(
        self,
        service: str,
        request: Any,
        first_id: int,
        *,
        text: tuple[str, str],
        ids: list[int],
        rehung: dict[int, list[float]],
    ) -> None:
        """Take an edit that counts from now on; with the world's lock held.

        ``text`` is the file that it read, if any, with its text; ``ids`` are those in its answer;
        ``rehung`` has the poses, row by row, of frames that hang on others from now on, which
        depend on when the edit began.
        """
        plain = deserialize_message(serialize_message(request), type(request))
        if hasattr(plain, "token"):
            plain.token = 0
        if hasattr(plain, "source"):
            plain.source.token = 0
        self._event(
            "edit",
            service=service,
            id=first_id,
            layout=layout_of(type(request)),
            request=text_of(serialize_message(plain)),
            path=text[0],
            text=text[1],
            ids=ids,
            rehung=rehung,
        )

    def described(
        self, source: str, text: str, first_id: int, rehung: dict[int, list[float]]
    ) -> None:
        """Record a robot's new description, as `edited` does; with the world's lock held."""
        self._event("described", source=source, text=text, id=first_id, rehung=rehung)

    def accuracy_set(self, accuracy: str) -> None:
        """Say that answers have this tier from now on; with the world's lock held."""
        self._event("accuracy", value=accuracy)

    def stamps_forgotten(self, after: int | None) -> None:
        """Say that stamps after a time were forgotten; with the world's lock held.

        None: all, with the messages that waited.
        """
        self._event("forget", after=after)

    def stopped(self) -> None:
        """Record that nothing is taken in any more, and that waiting inputs are forgotten."""
        self._seen.clear()
        self._first.clear()
        self._event("stop")

    def close(self) -> None:
        """End the recording."""
        self._spool.close()

    def failure(self) -> str:
        """Say why it ended before its time, "" where it did not."""
        return self._spool.failure

    def end(self) -> str:
        """Say why nothing more is recorded, "" while it goes on."""
        return self._spool.end

    def counters(self) -> Mapping[str, Any]:
        """Return counts of the records."""
        spool = self._spool
        return {
            "folder": self.folder,
            "messages": spool.written,
            "dropped": spool.dropped,
            "bytes": spool.size,
        }

    def _event(self, event: str, **values: Any) -> None:
        self._spool.put(self._events, "std_msgs/msg/String", encode(event, **values))
