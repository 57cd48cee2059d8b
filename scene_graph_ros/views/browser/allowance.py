"""How often something may be done, and how fast: floods are cut off, hurry is slowed down."""

from __future__ import annotations

import asyncio
import time

__all__ = ["Allowance", "Pace"]


class Allowance:
    """How often the other side may still do something."""

    def __init__(self, per_second: float, at_once: float = 0.0) -> None:
        """Allow ``at_once`` after a pause, as many as in a second unless that is given."""
        self._per_second, self._most = per_second, at_once or per_second
        self._left = self._most
        self._last = time.monotonic()

    def is_used_up(self) -> bool:
        """Take one off; tell whether it was one too many."""
        now = time.monotonic()
        self._left = min(self._left + (now - self._last) * self._per_second, self._most) - 1.0
        self._last = now
        return self._left < 0.0


class Pace:
    """Spreads work over time, for all its users together."""

    def __init__(self, per_second: float, at_once: float = 0.0) -> None:
        """Let pass ``per_second``, and ``at_once`` more after a pause."""
        self._per_second, self._ahead = per_second, at_once / per_second
        self._due = 0.0

    async def wait(self, amount: float = 1.0) -> None:
        """Wait until so much more may be done."""
        now = time.monotonic()
        begin = max(self._due, now - self._ahead)
        self._due = begin + amount / self._per_second
        if begin > now:
            await asyncio.sleep(begin - now)
