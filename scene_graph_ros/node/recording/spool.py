"""The thread that writes a recording: the node never waits for the disk."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from pathlib import Path
import threading
import time
from typing import NamedTuple

from rclpy.qos import QoSProfile

from scene_graph_ros.node.recording.bag import Bag
from scene_graph_ros.node.recording.events import encode
from scene_graph_ros.node.runtime.own_threads import stop_at_exit

__all__ = ["Spool"]

_MOST_WAITING = 1 << 26
"""Bytes that may wait for the disk, 64 MiB: some twenty seconds of the demo's cell in motion."""

_OVERHEAD = 200
"""Bytes that a message takes in memory beside its own."""

_FLUSH_PERIOD = 0.5
"""Seconds of a recording that a kill may cost."""


def _ignore(reason: str) -> None:
    """Leave the reason to `Spool.failure`."""


class _Item(NamedTuple):
    topic: str
    kind: str
    qos: QoSProfile | None
    time: int
    data: bytes


class Spool:
    """Messages on their way to a `Bag`, in the order of their times, which all differ."""

    def __init__(
        self,
        folder: Path,
        events_topic: str,
        most_bytes: int,
        failed: Callable[[str], object] = _ignore,
    ) -> None:
        """Begin a recording that ends where the file would be larger than ``most_bytes``.

        ``failed`` is told, in the thread that writes, why a recording ended before its time.
        Raises OSError where the folder can't be made.
        """
        # The system's time at the start, and steady from there.
        self._offset = time.time_ns() - time.monotonic_ns()
        self._bag = Bag(folder, time.time_ns())
        self._events_topic, self._most_bytes = events_topic, most_bytes
        self._failed = failed
        self._waiting: deque[_Item] = deque()
        self._changed = threading.Condition()
        self._waiting_bytes = 0
        self._last = 0
        self._lost = 0
        self._is_closing = self._is_over = False
        self.dropped = 0
        self.written = 0
        self.size = self._bag.size
        self.end = ""
        self.failure = ""
        self._thread = threading.Thread(target=self._run, name="recording", daemon=True)
        self._thread.start()
        stop_at_exit(self, Spool.close)

    @property
    def is_open(self) -> bool:
        """Whether messages are still taken."""
        return not (self._is_over or self._is_closing)

    def put(self, topic: str, kind: str, data: bytes, *, qos: QoSProfile | None = None) -> None:
        """Take a message; safe from any thread. One that finds no room is dropped and counted."""
        with self._changed:
            if not self.is_open:
                return
            if self._waiting_bytes + len(data) > _MOST_WAITING:
                self.dropped += 1
                self._lost += 1
                return
            if self._lost:
                lost, self._lost = self._lost, 0
                self._append(self._events_topic, "std_msgs/msg/String", encode("lost", count=lost))
            self._append(topic, kind, data, qos)

    def _append(self, topic: str, kind: str, data: bytes, qos: QoSProfile | None = None) -> None:
        now = max(time.monotonic_ns() + self._offset, self._last + 1)
        self._last = now
        self._waiting.append(_Item(topic, kind, qos, now, data))
        self._waiting_bytes += len(data) + _OVERHEAD

    def close(self) -> None:
        """Write the waiting messages and the index."""
        with self._changed:
            self._is_closing = True
            self._changed.notify()
        self._thread.join()

    # In the thread.

    def _run(self) -> None:
        try:
            while self.is_open:
                with self._changed:
                    self._changed.wait_for(lambda: self._is_closing, _FLUSH_PERIOD)
                self._write()
                self._bag.flush()
                self.size = self._bag.size
            self._write()  # what came while the last was written
            self._bag.close()
            if self._is_over:
                self.end = f"the recording has record_max_bytes, {self._most_bytes}, and ended"
        except Exception as error:  # noqa: BLE001 - the node outlives its recording, and says so
            self._fail(error)

    def _write(self) -> None:
        """Write the waiting messages, up to the limit."""
        while self._waiting:
            with self._changed:
                item = self._waiting.popleft()
                self._waiting_bytes -= len(item.data) + _OVERHEAD
            if self._bag.size + len(item.data) > self._most_bytes:
                self._take_no_more()
                return
            self._bag.write(*item)
            self.written += 1

    def _take_no_more(self) -> None:
        with self._changed:
            self._is_over = True
            self._waiting.clear()

    def _fail(self, error: Exception) -> None:
        self._take_no_more()
        reason = f"the recording ended: {type(error).__name__}: {error}"
        try:
            self._bag.abort()
        except OSError as second:
            reason += f"; what is whole of it could not be kept apart: {second}"
        self.failure = self.end = reason
        self._failed(reason)
