"""Messages that are large: few of them wait for the update, and the oldest make room."""

from __future__ import annotations

from abc import abstractmethod
from collections import deque
import threading
from typing import Any, TypeVar

from scene_graph_ros.node.world.faults import Fault
from scene_graph_ros.node.world.intake import Intake
from scene_graph_ros.node.world.scene import SourceRecord
from scene_graph_ros.node.world.source_channel import Kept, SourceChannel
from scene_graph_ros.node.world.time_limits import TimeLimits

__all__ = ["BoundedChannel", "NewestChannel"]

T = TypeVar("T")


class BoundedChannel(SourceChannel[Kept, T]):
    """Keeps the newest messages, ``queued`` at most; all of them are read."""

    queued = 16

    def __init__(self, record: SourceRecord, intake: Intake, kind: Any) -> None:
        super().__init__(record, intake, kind)
        self._lock = threading.Lock()
        self._kept: deque[Kept] = deque()

    def store(self, data: bytes, arrival: int, *, is_static: bool = False) -> None:
        """Keep a message that arrived at a steady time (ns)."""
        statistics = self.intake.statistics
        statistics.arrived(arrival, is_static=is_static)
        with self._lock:
            while len(self._kept) >= self.queued:
                self._make_room()
                statistics.superseded += 1
            self._kept.append(Kept(data, arrival, is_static))

    def _make_room(self) -> None:
        self._kept.popleft()

    def take(self) -> list[Kept]:
        """Take all messages that were kept, oldest first."""
        with self._lock:
            taken = list(self._kept)
            self._kept.clear()
        return taken

    def _worth_reading(self, kept: list[Kept]) -> list[Kept]:
        return kept


class NewestChannel(BoundedChannel[T]):
    """Of several messages between two updates the newest good one is applied.

    No older one is read.
    """

    queued = 2

    def apply(self, kept: list[Kept], target: T, limits: TimeLimits) -> int | None:
        """Apply the newest message that is good; return when it arrived, None without one."""
        for older, one in zip(range(len(kept) - 1, -1, -1), reversed(kept), strict=True):
            arrival = super().apply([one], target, limits)
            if arrival is not None:
                self.intake.statistics.superseded += older
                return arrival
        return None

    @abstractmethod
    def _apply_one(self, kept: Kept, target: T, limits: TimeLimits) -> int:
        """Apply a message; return of how many things. Raises SceneGraphError."""

    def _fault(self, fault: Fault, detail: str, frame: str = "") -> int:
        """Count a message as faulty; return that nothing was applied."""
        self.intake.fault(fault, frame, detail)
        return 0
