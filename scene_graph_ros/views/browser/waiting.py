"""Messages that wait for slow clients, in bytes for all of them together."""

from __future__ import annotations

from collections.abc import Callable, Hashable
import threading
from typing import NamedTuple

__all__ = ["MOST_WAITING", "Load", "Waiting"]

MOST_WAITING = 1 << 27
"""Bytes that may wait for all clients together, 128 MiB, or one message that is larger."""


class Load:
    """A message that waits for some clients: it is there once, however many these are."""

    __slots__ = ("readers", "size")

    def __init__(self, size: int) -> None:
        """``size`` in bytes."""
        self.size, self.readers = size, 0


class _Sending(NamedTuple):
    load: Load
    cut_off: Callable[[], None]


class Waiting:
    """Counts loads while somebody holds them, and cuts clients off where that is too much."""

    def __init__(self, most: int = MOST_WAITING) -> None:
        """``most`` in bytes."""
        self._most = most
        self._lock = threading.Lock()
        self._sending: dict[Hashable, _Sending] = {}
        self.bytes = 0
        """That wait now."""

    def hold(self, load: Load) -> None:
        """Count a load for one client more."""
        with self._lock:
            self._hold(load)

    def release(self, load: Load) -> None:
        """Count it for one client less."""
        with self._lock:
            self._release(load)

    def is_over(self) -> bool:
        """Tell whether more waits than may."""
        return self.bytes > self._most

    def begin(self, client: Hashable, load: Load, cut_off: Callable[[], None]) -> None:
        """Count a load that a client is being sent; ``cut_off`` ends its connection, at once.

        It is called, from any thread, where messages on their way take half of the room, and this
        client's is the oldest; then nothing is counted for it any more. So clients that read get
        more, however many do not.
        """
        with self._lock:
            self._hold(load)
            self._sending[client] = _Sending(load, cut_off)
            ended = self._too_slow()
        for sending in ended:
            sending.cut_off()

    def end(self, client: Hashable) -> None:
        """Count a client's load no longer."""
        with self._lock:
            sending = self._sending.pop(client, None)
            if sending is not None:
                self._release(sending.load)

    def _too_slow(self) -> list[_Sending]:
        """Take out the clients with the oldest messages, while these take too much."""
        ended = []
        while len(self._sending) > 1:
            loads = {sending.load for sending in self._sending.values()}
            if 2 * sum(load.size for load in loads) <= self._most:
                break
            sending = self._sending.pop(next(iter(self._sending)))
            self._release(sending.load)
            ended.append(sending)
        return ended

    def _hold(self, load: Load) -> None:
        self.bytes += load.size if load.readers == 0 else 0
        load.readers += 1

    def _release(self, load: Load) -> None:
        load.readers -= 1
        self.bytes -= load.size if load.readers == 0 else 0
