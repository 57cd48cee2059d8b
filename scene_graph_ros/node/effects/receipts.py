"""Whether the readers of a topic have all messages, without waiting for one that is stuck.

A topic that keeps its last few messages may lose one: where a reliable reader has not got it yet,
and as many others were sent meanwhile, it is gone. So the sender waits - but the middleware only
tells whether all readers have everything, and one that is stopped, or died without a word, would
hold up all others. It is waited for once, shortly. Then it is left behind until it acknowledges
again or is given up, and its lost messages are to be made good.
"""

from __future__ import annotations

from collections.abc import Callable
import math
import time

__all__ = ["Receipts"]

_PATIENCE = 0.2
"""Seconds that an acknowledgement may take: far longer than a round trip on a busy machine."""

_REPEAT = 1.0
"""Seconds between two repetitions of everything while a reader is left behind. Whether the
others have got a message can't be known then."""

_AGAIN = 5.0
"""Seconds after which one that is back is told once more. When it goes on it may acknowledge first
and then give the sender up, from which it has not heard: what it was told in between is lost, and
nobody is told so. If they find each other again it is within three seconds."""


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
        self._may_one_return = False
        self._next_repeat = 0.0
        self._next_reminder = math.inf

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
            if self._is_one_left_behind:
                self._may_one_return = True
                self._begin_anew()
            self._is_one_left_behind = False
            return False
        if self._unacknowledged < self._depth or self._is_one_left_behind:
            return False
        return self._clock() - self._oldest < _PATIENCE

    def _begin_anew(self) -> None:
        self._has_one_missed, self._next_reminder = True, self._clock() + _AGAIN

    def note_newcomer(self) -> None:
        """Take note of a new reader: after one was given up it may be that one."""
        if self._may_one_return:
            self._may_one_return = False
            self._begin_anew()

    def take_missed(self) -> bool:
        """Tell that one which was left behind is back, or gone: once, and a little later again."""
        if self._clock() >= self._next_reminder:
            self._has_one_missed, self._next_reminder = True, math.inf
        missed, self._has_one_missed = self._has_one_missed, False
        return missed

    def take_repeat(self) -> bool:
        """Tell, now and then while one is left behind, that it is time to repeat everything."""
        now = self._clock()
        if not self._is_one_left_behind or now < self._next_repeat:
            return False
        self._next_repeat = now + _REPEAT
        return True
