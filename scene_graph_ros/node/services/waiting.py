"""Requests that wait for poses: kept aside, and answered when the poses or the deadline come.

No thread waits: a service keeps a ``PendingAnswer`` here in place of a response and goes back to
other work; the response is sent when an update or the alarm says so.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
import threading
import time
from typing import Any

from scene_graph_ros.geometry.errors import SceneGraphError
from scene_graph_ros.node.world.intake import UNSTAMPED
from scene_graph_ros.node.world.world import World, WorldSnapshot

__all__ = ["PendingAnswer", "PoseRequirement", "Waiting"]


@dataclass(frozen=True)
class PoseRequirement:
    """The poses that a request needs: as new as ``stamp`` (ns), of ``sources`` or of any.

    ``sources`` are names of sources, or of joints and frames as ``source/joint``.
    """

    stamp: int
    sources: tuple[str, ...]
    seconds: float

    def is_met(self, snapshot: WorldSnapshot) -> bool:
        """Tell whether a snapshot is new enough."""
        if not self.sources:
            return snapshot.stamp >= self.stamp
        return all(self._age(snapshot, name) >= self.stamp for name in self.sources)

    @staticmethod
    def _age(snapshot: WorldSnapshot, name: str) -> int:
        if "/" not in name:
            return snapshot.source_stamp(name)
        stamp = snapshot.joint_stamp(name)
        if stamp is not None:
            return stamp
        try:
            return snapshot.frame_stamp(name)
        except SceneGraphError:  # it was removed meanwhile
            return UNSTAMPED

    def oldest(self, snapshot: WorldSnapshot) -> tuple[str, int]:
        """Return the oldest of all that is needed, and its stamp."""
        if not self.sources:
            return "", snapshot.stamp
        stamp, name = min((self._age(snapshot, name), name) for name in self.sources)
        return name, stamp


@dataclass(eq=False)
class PendingAnswer:
    """Stands for a response that is not there yet; ``answer`` makes it."""

    requirement: PoseRequirement
    answer: Callable[[], Any]
    send: Callable[[Any], None]
    deadline: float = field(init=False)

    def __post_init__(self) -> None:
        self.deadline = time.monotonic() + self.requirement.seconds

    def finish(self) -> None:
        """Make the response and send it."""
        self.send(self.answer())


class Waiting:
    """All requests that wait; while there are some, the world tells of each snapshot."""

    def __init__(
        self,
        world: World,
        is_running: Callable[[], bool],
        *,
        post: Callable[[Callable[[], None]], None],
        set_alarm: Callable[[float, Callable[[], None]], None],
    ) -> None:
        """Answer about ``world``; where ``is_running`` is false nobody has to wait any more.

        ``post`` hands answers to the threads that make them. ``set_alarm`` is told a steady time
        in seconds, and the task to do then.
        """
        self._world, self._is_running = world, is_running
        self._post, self._set_alarm = post, set_alarm
        self._lock = threading.Lock()
        self._waiting: list[PendingAnswer] = []

    def can_wait(self, requirement: PoseRequirement) -> bool:
        """Tell whether poses may still come for a request, within its time."""
        return requirement.seconds > 0.0 and self._is_running()

    def add(self, pending: PendingAnswer, limit: int) -> bool:
        """Answer a request when its time has come; return False where ``limit`` wait already."""
        with self._lock:
            if len(self._waiting) >= limit:
                return False
            self._keep([*self._waiting, pending])
            self._arm()
        # What came between the look at the world and this is answered now.
        self._release()
        return True

    def _keep(self, waiting: list[PendingAnswer]) -> None:
        """Let these wait, and have the world tell of each snapshot."""
        if waiting and not self._waiting:
            self._world.watch(self._release)
        elif self._waiting and not waiting:
            self._world.unwatch(self._release)
        self._waiting = waiting

    def _on_alarm(self) -> None:
        """Answer those whose time is over."""
        self._release()
        with self._lock:
            self._arm()

    def close(self) -> None:
        """Answer all that wait, now."""
        with self._lock:
            waiting = self._waiting
            self._keep([])
        for pending in waiting:
            pending.finish()

    def _release(self) -> None:
        """Answer requests for which the newest snapshot is new enough, or whose time is over."""
        snapshot, now, runs = self._world.snapshot, time.monotonic(), self._is_running()
        with self._lock:
            ready: list[PendingAnswer] = []
            others: list[PendingAnswer] = []
            for pending in self._waiting:
                is_ready = (
                    not runs or now >= pending.deadline or pending.requirement.is_met(snapshot)
                )
                (ready if is_ready else others).append(pending)
            self._keep(others)
        for pending in ready:
            self._post(pending.finish)

    def _arm(self) -> None:
        if self._waiting:
            self._set_alarm(min(pending.deadline for pending in self._waiting), self._on_alarm)
