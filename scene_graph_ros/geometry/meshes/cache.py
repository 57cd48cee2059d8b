"""A memory of what was built, shared by all scenes of a process."""

from __future__ import annotations

from collections.abc import Callable, Hashable
import itertools
from typing import Generic, TypeVar

__all__ = ["BuildCache"]

Value = TypeVar("Value")


class _Entry(Generic[Value]):
    """A value, and when it was last asked for."""

    __slots__ = ("used", "value")

    def __init__(self, value: Value) -> None:
        self.value, self.used = value, -1


class BuildCache(Generic[Value]):
    """What was built last, by key; the least recently used entries go first.

    Any thread may ask. There is no lock that an interrupted thread could leave to the others: each
    step is one operation of a dict. Threads that miss a key at the same time each build it, and
    all get the value of the first that has ended.
    """

    def __init__(self, capacity: int) -> None:
        """Keep at most ``capacity`` entries."""
        self._capacity = capacity
        self._entries: dict[Hashable, _Entry[Value]] = {}
        self._clock = itertools.count()

    def get(self, key: Hashable, build: Callable[[], Value]) -> Value:
        """Return what was built for ``key``, or build it now."""
        entry = self._entries.get(key)
        if entry is None:
            entry = self._entries.setdefault(key, _Entry(build()))
        entry.used = next(self._clock)
        while len(self._entries) > self._capacity:
            oldest = min(list(self._entries.items()), key=lambda item: item[1].used)
            self._entries.pop(oldest[0], None)
        return entry.value
