"""The time limit and the watch function of a call that plans."""

from __future__ import annotations

from collections.abc import Callable
import math
from time import monotonic
from typing import Any

from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.reals import as_float
from scene_graph_ros.planning.errors import OutOfTimeError

__all__ = ["ENDLESS", "Deadline", "checked_timeout"]

_TURN = 0.05
"""Seconds between two calls of a watch function, at least."""


def checked_timeout(timeout: Any, error: Callable[[str], Exception]) -> float | None:
    """Return seconds from 0 on, or None. Raises an ``error`` for anything else."""
    patience = None if timeout is None else as_float(timeout)
    if timeout is not None and (patience is None or not 0.0 <= patience < math.inf):
        raise error(f"timeout must be seconds from 0 on, or None, not {quoted(timeout)}")
    return patience


class Deadline:
    """When a call is to end: after a time, or where its watch function raises an exception.

    Searches ask `is_over` or `check` again and again, at least every tenth of a second. The watch
    function is called at once, and then at most every 0.05 s. Sent to another process it is what
    is left of the time, without the watch function.
    """

    def __init__(self, timeout: float | None = None, watch: Callable[[], Any] | None = None):
        """Begin to count ``timeout`` (s), and call ``watch``."""
        self.timeout, self._watch = timeout, watch
        self._begin = monotonic()
        self._next_look = self._begin
        self.look()

    @classmethod
    def of(cls, timeout: Any, watch: Any, error: Callable[[str], Exception]) -> Deadline:
        """Return that of arguments. Raises an ``error`` for those that make no sense."""
        if watch is not None and not callable(watch):
            raise error(f"watch must be a function, or None, not {quoted(watch)}")
        return cls(checked_timeout(timeout, error), watch)

    def __reduce__(self) -> tuple[Any, ...]:
        """Return the deadline of another process."""
        return Deadline, (self.left,)

    def apart(self) -> Deadline:
        """Return one of what is left, for other threads and processes: they call nobody."""
        return Deadline(self.left)

    @property
    def is_set(self) -> bool:
        """Whether there is a time limit, or anyone to call."""
        return self.timeout is not None or self._watch is not None

    @property
    def seconds(self) -> float:
        """Since it began."""
        return monotonic() - self._begin

    @property
    def late(self) -> float:
        """Seconds since the time was over: negative before, -inf without a time limit."""
        return -math.inf if self.timeout is None else self.seconds - self.timeout

    @property
    def left(self) -> float | None:
        """Seconds that are left, from 0 on; None without a time limit."""
        return None if self.timeout is None else max(-self.late, 0.0)

    def look(self) -> None:
        """Call the watch function, if it is its turn."""
        if self._watch is not None and monotonic() >= self._next_look:
            self._watch()
            self._next_look = monotonic() + _TURN

    def is_over(self) -> bool:
        """Tell whether the time is over; may raise what the watch function raises."""
        self.look()
        return self.late >= 0.0

    def check(self, what: str) -> None:
        """Raise OutOfTimeError with a sentence on ``what`` if the time is over."""
        if self.is_over():
            raise OutOfTimeError(f"{what} within {self.timeout:.10g} s")


ENDLESS = Deadline()
"""Of calls that nobody ends."""
