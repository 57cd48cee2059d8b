"""Kernels that end in time or when told to, in turns or beside whoever waits for them."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor, wait
import math
import time
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

__all__ = ["ENDLESS", "LOOKS", "Stops", "Turns", "new_stop", "run_stoppable"]

_Answer = TypeVar("_Answer")

_GRACE = 0.05
"""Seconds after the time is over in which what was found may still be proven."""


_TURN = 0.05
"""Seconds after which waiting looks whether a signal has come."""

LOOKS = 2048
"""Configurations that kernels look at in a turn: 4 ms among 30 things, 50 ms among thousands."""


ENDLESS = 2**62
"""Looks that are never made."""


def new_stop() -> NDArray[np.int64]:
    """Return a flag that stops a proof in another thread, once its first entry is 1.

    The second is after how many looks an edge is left unfinished.
    """
    return np.array([0, ENDLESS], dtype=np.int64)


class Stops(NamedTuple):
    """Flags that are set to 1 when it is time to stop: the first entries of both."""

    looking: NDArray[np.int64]
    """``(2,)``: look for nothing new; see `new_stop`."""
    proving: NDArray[np.int64]
    """``(2,)``: do nothing any more."""


class Turns:
    """Kernels that take turns with whoever waits for them, in one thread.

    A thread beside this one takes half a millisecond to start and end, which is as long as many a
    plan. So kernels return after a while, and `pause` looks at the time. Work that might take long
    by itself is done by `beside`.
    """

    def __init__(self, timeout: float | None, watch: Callable[[], None]) -> None:
        """Begin to count time; ``watch`` is called now and then, and may raise an exception."""
        self.stops = Stops(new_stop(), new_stop())
        self._watch, self._now = watch, time.monotonic()
        self._end = math.inf if timeout is None else self._now + timeout
        self._next_look = self._now
        self._is_beside = False
        # Without time nothing is looked for.
        self.stops.looking[0] = int(timeout == 0.0)
        for stop in self.stops:
            stop[1] = LOOKS
        self.pause()

    def pause(self) -> None:
        """See whether it is time to stop. Signals raise their exceptions here, too."""
        if self._is_beside:
            return  # The thread that waits sees that.
        now = time.monotonic()
        if now >= self._next_look:
            self._watch()
            self._next_look = now + _TURN
        if now >= self._end:
            self.stops.looking[0] = 1
            if now >= self._end + _GRACE:
                self.stops.proving[0] = 1

    def beside(self, job: Callable[[], _Answer]) -> _Answer:
        """Return the answer of a job whose kernels look at flags by themselves.

        It is done by another thread, which sees when it is to stop.
        """
        for stop in self.stops:
            stop[1] = ENDLESS
        self._is_beside = True
        try:
            return _waited_for(job, self.stops, self._end, self._watch)
        finally:
            for stop in self.stops:
                stop[1] = LOOKS
            self._is_beside = False
            self.pause()


def run_stoppable(
    job: Callable[[Stops], _Answer],
    timeout: float | None,
    watch: Callable[[], None] = lambda: None,
) -> _Answer:
    """Return the answer of the job, which must look at its flags.

    It is told to stop after ``timeout`` (s), or where waiting ends in an exception, such as
    KeyboardInterrupt. ``watch`` is called now and then while it is waited for, and may raise one.
    """
    stops = Stops(new_stop(), new_stop())
    # Without time nothing is looked for, however soon the other thread begins.
    stops.looking[0] = int(timeout == 0.0)
    end = math.inf if timeout is None else time.monotonic() + timeout
    return _waited_for(lambda: job(stops), stops, end, watch)


def _waited_for(
    job: Callable[[], _Answer], stops: Stops, end: float, watch: Callable[[], None]
) -> _Answer:
    """Return the answer of a job in another thread; from ``end`` on it is told to stop."""
    is_over = False
    with ThreadPoolExecutor(1) as pool:
        future = pool.submit(job)
        try:
            for stop, until in ((stops.looking, end), (stops.proving, end + _GRACE)):
                if _is_done(future, until, watch):
                    break
                stop[0] = 1
            answer = future.result()
            is_over = True
            return answer
        finally:
            if not is_over:
                for stop in stops:
                    stop[0] = 1


def _is_done(future: Future[_Answer], end: float, watch: Callable[[], None]) -> bool:
    """Wait for an answer until then at most; tell whether there is one."""
    while True:
        watch()
        # In short turns: another thread may be the one that a signal wakes.
        rest = min(_TURN, end - time.monotonic())
        if wait([future], max(rest, 0.0)).done:
            return True
        if rest < _TURN:
            return False
