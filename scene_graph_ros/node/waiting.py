"""Requests that wait for poses: kept aside, and answered when the poses or the deadline come.

An executor of rclpy polls every coroutine that awaits something, with a full core, so nothing is
awaited here: a service's callback returns a ``Later`` in place of a response, its thread goes
back to other work, and the response is sent when an update or a timer says so.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
import threading
import time
from typing import Any

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.clock import Clock, ClockType
from rclpy.exceptions import InvalidHandle
from rclpy.node import Node

from scene_graph_ros.node.world import WorldSnapshot

__all__ = ["Awaited", "Later", "Waiting"]

_LEAST_PERIOD = 1_000
"""Nanoseconds. A deadline that has passed meanwhile is a timer that is due at once."""


@dataclass(frozen=True)
class Awaited:
    """The poses that a request needs: as new as ``stamp`` (ns), of ``sources`` or of any."""

    stamp: int
    sources: tuple[str, ...]
    seconds: float

    def is_met(self, snapshot: WorldSnapshot) -> bool:
        """Tell whether a snapshot is new enough."""
        if self.stamp <= 0:
            return True
        if not self.sources:
            return snapshot.stamp >= self.stamp
        stamps = snapshot.source_stamps
        return all(stamps.get(source, 0) >= self.stamp for source in self.sources)


@dataclass(eq=False)
class Later:
    """Stands for a response that is not there yet; ``answer`` makes it."""

    awaited: Awaited
    answer: Callable[[], Any]
    send: Callable[[Any], None] | None = None
    deadline: float = field(init=False)

    def __post_init__(self) -> None:
        self.deadline = time.monotonic() + self.awaited.seconds

    def finish(self) -> None:
        """Make the response and send it."""
        assert self.send is not None
        try:
            self.send(self.answer())
        except InvalidHandle:
            # The service is gone, and with it whoever could be answered.
            return


class Waiting:
    """All requests that wait."""

    def __init__(
        self, node: Node, snapshot: Callable[[], WorldSnapshot], is_running: Callable[[], bool]
    ) -> None:
        """Answer from ``snapshot``; where ``is_running`` is false nobody has to wait any more."""
        self._node = node
        self._snapshot, self._is_running = snapshot, is_running
        self._lock = threading.Lock()
        self._waiting: list[Later] = []
        self._timer = node.create_timer(
            1.0,
            self._on_deadline,
            callback_group=MutuallyExclusiveCallbackGroup(),
            clock=Clock(clock_type=ClockType.STEADY_TIME),
            autostart=False,
        )

    def serve(self, service: Any) -> None:
        """Let the callback of ``service`` return a ``Later``."""
        send_response = service.send_response

        def send(response: Any, header: Any) -> None:
            if isinstance(response, Later):
                response.send = lambda answer: send_response(answer, header)
                self._add(response)
            else:
                send_response(response, header)

        service.send_response = send

    def check(self) -> None:
        """Answer whom the newest snapshot is new enough for; call it after each update."""
        if self._waiting:
            self._release(self._ready())

    def close(self) -> None:
        """Answer all that wait, now."""
        with self._lock:
            waiting, self._waiting = self._waiting, []
        for later in waiting:
            later.finish()
        self._node.destroy_timer(self._timer)

    def _add(self, later: Later) -> None:
        with self._lock:
            self._waiting.append(later)
            self._arm()
        # What came between the look at the world and this is answered now.
        self.check()

    def _ready(self) -> list[Later]:
        snapshot, now, runs = self._snapshot(), time.monotonic(), self._is_running()
        with self._lock:
            ready = [
                later
                for later in self._waiting
                if not runs or now >= later.deadline or later.awaited.is_met(snapshot)
            ]
            self._waiting = [later for later in self._waiting if later not in ready]
        return ready

    def _release(self, ready: list[Later]) -> None:
        executor = self._node.executor
        for later in ready:
            if executor is None:
                later.finish()
            else:
                executor.create_task(later.finish)

    def _on_deadline(self) -> None:
        self._release(self._ready())
        with self._lock:
            if self._waiting:
                self._arm()
            else:
                self._timer.cancel()

    def _arm(self) -> None:
        earliest = min(later.deadline for later in self._waiting)
        remaining = int((earliest - time.monotonic()) * 1e9)
        self._timer.timer_period_ns = max(remaining, _LEAST_PERIOD)
        self._timer.reset()
