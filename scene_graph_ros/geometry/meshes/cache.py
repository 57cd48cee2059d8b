"""A memory of what was built, shared by all scenes of a process."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable
import threading
from typing import Generic, TypeVar

__all__ = ["BuildCache"]

Value = TypeVar("Value")


class BuildCache(Generic[Value]):
    """What was built last, by key; thread-safe, the least recently used entries go first."""

    def __init__(self, capacity: int) -> None:
        """Keep at most ``capacity`` entries."""
        self._capacity = capacity
        self._lock = threading.RLock()  # A thread that is interrupted may come once more.
        self._entries: OrderedDict[Hashable, Value] = OrderedDict()

    def get(self, key: Hashable, build: Callable[[], Value]) -> Value:
        """Return what was built for ``key``, or build it now."""
        with self._lock:
            if key in self._entries:
                self._entries.move_to_end(key)
                return self._entries[key]
        value = build()  # not under the lock: a large mesh must not hold up the others
        with self._lock:
            value = self._entries.setdefault(key, value)
            while len(self._entries) > self._capacity:
                self._entries.popitem(last=False)
        return value
