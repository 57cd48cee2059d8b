"""Whether the readers of a topic have what was sent, without waiting for one that is stuck.

A topic that keeps its last few messages may lose one: where a reliable reader has not got it yet,
and as many others were sent meanwhile, it is gone. So the sender waits - but the middleware only
tells whether all readers have everything, and one that is stopped, or died without a word, would
hold up all others. It is waited for once, shortly. Then it is left behind until it acknowledges
again or is given up, and what it missed is to be made good.
"""

from __future__ import annotations

from collections.abc import Callable
import time

__all__ = ["Receipts"]

_PATIENCE = 0.2
"""Seconds that an acknowledgement may take: far longer than a round trip on a busy machine."""

_REPEAT = 1.0
"""Seconds between two repetitions of everything while a reader is left behind. Whether the
others have got a message can't be known then."""


class Receipts:
    """Tells when another message may be sent, and when to tell everything anew."""

    def __init__(
        self,
        are_all_in: Callable[[], bool],
        depth: float,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Wait for readers of a topic that keeps ``depth`` messages.

        ``are_all_in`` tells whether each reliable reader has acknowledged all messages; ``clock``
        gives steady seconds.
        """
        self._are_all_in, self._depth, self._clock = are_all_in, depth, clock
        self._unacknowledged = 0
        self._oldest = 0.0
        self._is_one_left_behind = False
        self._has_one_missed = False
        self._next_repeat = 0.0

    def sent(self) -> None:
        """Take note that a message was sent."""
        now = self._clock()
        if not self._unacknowledged:
            self._oldest = now
        if self._unacknowledged >= self._depth and not self._is_one_left_behind:
            self._is_one_left_behind, self._next_repeat = True, now + _REPEAT
        self._unacknowledged += 1

    def is_on_its_way(self) -> bool:
        """Tell whether a message may be lost by sending another, and is worth waiting for."""
        if not self._unacknowledged:
            return False
        if self._are_all_in():
            self._unacknowledged = 0
            self._has_one_missed |= self._is_one_left_behind
            self._is_one_left_behind = False
            return False
        if self._unacknowledged < self._depth or self._is_one_left_behind:
            return False
        return self._clock() - self._oldest < _PATIENCE

    def take_missed(self) -> bool:
        """Tell, once, that a reader which was left behind is back, or gone."""
        missed, self._has_one_missed = self._has_one_missed, False
        return missed

    def take_repeat(self) -> bool:
        """Tell, now and then while one is left behind, that it is time to repeat everything."""
        now = self._clock()
        if not self._is_one_left_behind or now < self._next_repeat:
            return False
        self._next_repeat = now + _REPEAT
        return True
