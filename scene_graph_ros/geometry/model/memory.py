"""A context's memory from one moment to the next."""

from __future__ import annotations

from collections.abc import Callable, Hashable
import threading
from typing import Any, TypeVar

__all__ = ["Memory"]

About = TypeVar("About")
Value = TypeVar("Value")


class Memory:
    """Values that the snapshots of a context pass on, so that little motion costs little work.

    It changes how fast an answer is found, never the answer. Any thread may ask.
    """

    __slots__ = ("_known", "lock")

    def __init__(self) -> None:
        self.lock = threading.RLock()
        """Of who computes something of a snapshot that others may want at the same time."""
        self._known: dict[Hashable, tuple[Any, Any]] = {}

    def of(self, begin: Callable[[About], Value], about: About, *which: Hashable) -> Value:
        """Return the value of ``begin(about)`` when last begun, for as long as it is about that.

        ``begin`` is a function of a module; its value is valid for one object ``about``,
        and begun anew for another. ``which`` tells apart values begun alike.
        """
        key = (begin, which)
        known = self._known.get(key)
        if known is None or known[0] is not about:
            known = self._known[key] = (about, begin(about))
        result: Value = known[1]
        return result
