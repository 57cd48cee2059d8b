"""An effect that follows snapshots in a thread of its own: two topics with the changes."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Mapping
import threading
import time
import traceback
from typing import Any, Generic, TypeVar

from visualization_msgs.msg import MarkerArray

from scene_graph_ros.node.effects.effect import Host, Outlet
from scene_graph_ros.node.effects.frames import FrameThread
from scene_graph_ros.node.runtime.qos import latched_qos
from scene_graph_ros.node.world.world import WorldSnapshot

__all__ = ["FollowingEffect"]

Followed = TypeVar("Followed")

_RECENT = 100
"""Looks whose times are remembered."""


class FollowingEffect(ABC, Generic[Followed]):
    """Publishes the changed state of an object, and markers of it, for subscribers.

    It looks at the newest snapshot as often as markers may be published. Both topics are latched;
    each is told anew when it is in ``_untold``, or has a new subscriber.
    """

    what: str
    """What it follows, in a sentence: "regions can't be looked at"."""
    counted: str
    """What ``_note_look`` counts, in diagnostics."""

    def __init__(self, host: Host, thread: str, markers: str, message: Any, topic: str) -> None:
        """Publish a MarkerArray on the topic ``markers``, and a ``message`` on ``topic``."""
        self._host = host
        self._markers = Outlet(host, MarkerArray, markers, latched_qos())
        self._told = Outlet(host, message, topic, latched_qos())
        self._frames = FrameThread(thread, host.parameter("marker_rate"), self._make)
        self._publishing = threading.Lock()
        self._is_closed = False
        self._untold: set[Outlet] = set()
        self._failure = ""
        self._seconds: deque[float] = deque(maxlen=_RECENT)
        self._looks = 0

    def is_heard(self) -> bool:
        """Tell whether either topic has subscribers."""
        return self._markers.is_heard() or self._told.is_heard()

    def has_work(self) -> bool:
        """Tell whether somebody listens."""
        return self.is_heard()

    def prepare(self, snapshot: WorldSnapshot) -> None:
        """Do nothing: slow work is done in a thread of its own."""

    def update(self, snapshot: WorldSnapshot) -> None:
        """Hand the snapshot to that thread."""
        self._frames.offer(snapshot)

    def close(self) -> None:
        """Stop being advertised."""
        self._frames.stop()
        with self._publishing:
            self._is_closed = True
            self._markers.close()
            self._told.close()

    def failure(self) -> str:
        """Say why it could not be looked at, "" where it could."""
        return self._failure

    def recent_seconds(self) -> list[float]:
        """Return the times (s) of the last looks."""
        return list(self._seconds)

    def count(self) -> int:
        """Return the number of changes."""
        return self._looks

    def counters(self) -> Mapping[str, Any]:
        """Return counts of changes and of messages published."""
        return {
            self.counted: self._looks,
            "marker messages": self._markers.messages,
            "messages": self._told.messages,
        }

    # In its own thread.

    @abstractmethod
    def _follow(self, snapshot: WorldSnapshot) -> Followed | None:
        """Look at a snapshot, and note unpublished topics in ``_untold``; None of nothing."""

    @abstractmethod
    def _message(self, followed: Followed) -> Any:
        """Return the message."""

    @abstractmethod
    def _marks(self, followed: Followed) -> MarkerArray:
        """Return the markers."""

    def _note_look(self, begin: float) -> None:
        """Count a look that found something, and its time since ``begin`` (perf_counter)."""
        self._seconds.append(time.perf_counter() - begin)
        self._looks += 1

    def _make(self, snapshot: WorldSnapshot) -> None:
        try:
            followed = self._follow(snapshot)
            if followed is None:
                return
            for outlet, message in ((self._told, self._message), (self._markers, self._marks)):
                if outlet.take_newcomers():
                    self._untold.add(outlet)
                if outlet in self._untold and outlet.is_due():
                    self._untold.discard(outlet)
                    self._publish(outlet, message(followed))
            self._failure = ""
        except Exception as error:  # noqa: BLE001 - what fails here costs nothing else
            if not self._is_closed and not self._failure:
                self._host.node.get_logger().error(
                    f"{self.what} can't be looked at:\n{traceback.format_exc()}"
                )
            self._failure = f"{type(error).__name__}: {error}"

    def _publish(self, outlet: Outlet, message: Any) -> None:
        with self._publishing:
            if not self._is_closed:
                outlet.publish(message)
