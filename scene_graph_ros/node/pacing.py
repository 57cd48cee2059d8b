"""When the world is updated: as soon as poses arrive, never too often, and now and then anyway."""

from __future__ import annotations

from collections.abc import Callable
import threading
import time

from rclpy.callback_groups import CallbackGroup
from rclpy.clock import Clock, ClockType
from rclpy.node import Node

__all__ = ["Pacing"]

_IDLE_SLACK = 0.9
"""Part of the idle period after which an update counts as due: timers are never quite exact."""


class Pacing:
    """Calls ``update`` in one callback group, by a steady clock whatever time ROS has."""

    def __init__(
        self,
        node: Node,
        group: CallbackGroup,
        update: Callable[[], None],
        *,
        max_rate: Callable[[], float],
        min_rate: Callable[[], float],
    ) -> None:
        self._update = update
        self._max_rate, self._min_rate = max_rate, min_rate
        self._last = float("-inf")
        self._wanted = False
        self._lock = threading.Lock()
        self._is_paused = True
        clock = Clock(clock_type=ClockType.STEADY_TIME)
        self._guard = node.create_guard_condition(self._on_wanted, callback_group=group)
        self._later = node.create_timer(
            1.0 / max_rate(), self._on_later, callback_group=group, clock=clock, autostart=False
        )
        self._idle = node.create_timer(
            1.0 / min_rate(), self._on_idle, callback_group=group, clock=clock, autostart=False
        )

    def request(self) -> None:
        """Ask for an update as soon as the largest rate allows; safe from any thread."""
        if not self._wanted and not self._is_paused:
            self._wanted = True
            self._guard.trigger()

    def resume(self) -> None:
        """Begin to call ``update``."""
        with self._lock:
            self._is_paused = False
            self._idle.reset()

    def pause(self) -> None:
        """Stop calling ``update``.

        The timers are cancelled by their own callbacks: to rclpy a timer that another thread
        cancels just when it is due is an error, which ends the executor.
        """
        with self._lock:
            self._is_paused = True
            self._wanted = False

    def _on_wanted(self) -> None:
        if not self._wanted or self._is_paused:
            return
        wait = self._last + 1.0 / self._max_rate() - time.monotonic()
        if wait <= 0.0:
            self._run()
        else:
            self._later.timer_period_ns = int(wait * 1e9)
            self._later.reset()

    def _on_later(self) -> None:
        self._later.cancel()
        if self._wanted and not self._is_paused:
            self._run()

    def _on_idle(self) -> None:
        with self._lock:
            if self._is_paused:
                self._idle.cancel()
                return
        period = 1.0 / self._min_rate()
        if self._idle.timer_period_ns != int(period * 1e9):
            self._idle.timer_period_ns = int(period * 1e9)
        if time.monotonic() - self._last >= _IDLE_SLACK * period:
            self._run()

    def _run(self) -> None:
        # Cleared first: what arrives during the update asks for the next one.
        self._wanted = False
        self._last = time.monotonic()
        self._update()
