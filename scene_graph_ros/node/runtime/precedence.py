"""Updates of the world go before computations beside them in Python.

Two threads that compute in Python at the same time share one interpreter. An update gives it up
many times, whenever a kernel or the middleware goes on without it, and each time has to wait
for it again: 18 ms were seen instead of 2. So a change of the scene, which is done in short steps
(`geometry.steps`), stands back between them while an update is on its way.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
import threading
import time

__all__ = ["Precedence"]

_LONGEST = 0.01
"""Seconds that others stand back at most: where updates never end, they go on as well."""

_STEP = 0.001
"""Seconds that they go on for at least before they stand back again."""


class Precedence:
    """Held by an update, while others stand back between their steps."""

    def __init__(self, longest: float = _LONGEST, step: float = _STEP) -> None:
        """Others stand back for ``longest`` seconds at most, and go on for ``step`` at least."""
        self._longest, self._step = longest, step
        self._went_on = float("-inf")
        self._is_free = threading.Event()
        self._is_free.set()

    @contextmanager
    def taken(self) -> Iterator[None]:
        """Go before others meanwhile; for one thread."""
        self._is_free.clear()
        try:
            yield
        finally:
            self._is_free.set()

    @contextmanager
    def left(self) -> Iterator[None]:
        """Let others go on meanwhile, in the thread that has precedence."""
        self._is_free.set()
        try:
            yield
        finally:
            self._is_free.clear()

    def stand_back(self) -> None:
        """Wait until nobody goes before, but not for long; hold nothing that an update needs.

        For one thread at a time.
        """
        if time.monotonic() - self._went_on < self._step:
            return
        self._is_free.wait(self._longest)
        self._went_on = time.monotonic()
