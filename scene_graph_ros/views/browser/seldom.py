"""Calls that many ask for, made now and then for all of them."""

from __future__ import annotations

from collections.abc import Callable
import threading
import time

__all__ = ["Seldom"]


class Seldom:
    """Calls a function at once, but no more than once in a period.

    Earlier calls are served together at the end of the period.
    """

    def __init__(self, function: Callable[[], None], period: float) -> None:
        """``period`` in seconds. Later calls are made in a thread of their own."""
        self._function, self._period = function, period
        self._lock = threading.Lock()
        self._last = float("-inf")
        self._is_coming = False

    def __call__(self) -> None:
        """Ask for a call."""
        with self._lock:
            if self._is_coming:
                return
            wait = self._last + self._period - time.monotonic()
            if wait > 0.0:
                self._is_coming = True
                timer = threading.Timer(wait, self._call_late)
                timer.daemon = True
                timer.start()
                return
            self._last = time.monotonic()
        self._function()

    def _call_late(self) -> None:
        with self._lock:
            self._is_coming, self._last = False, time.monotonic()
        self._function()
