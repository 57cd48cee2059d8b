"""Kernels that end in time or when told to, in turns or beside whoever waits for them."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor, wait
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.planning.parallel.deadline import Deadline

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
        self._deadline = Deadline(timeout, watch)
        self._is_beside = False
        for stop in self.stops:
            stop[1] = LOOKS
        self.pause()

    def pause(self) -> None:
        """See whether it is time to stop. Signals raise their exceptions here, too."""
        if self._is_beside:
            return  # The thread that waits sees that.
        self._deadline.look()
        late = self._deadline.late
        if late >= 0.0:
            self.stops.looking[0] = 1
            if late >= _GRACE:
                self.stops.proving[0] = 1

    def beside(self, job: Callable[[], _Answer]) -> _Answer:
        """Return the answer of a job whose kernels look at flags by themselves.

        It is done by another thread, which sees when it is to stop.
        """
        for stop in self.stops:
            stop[1] = ENDLESS
        self._is_beside = True
        try:
            return _waited_for(job, self.stops, self._deadline)
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
    return _waited_for(lambda: job(stops), stops, Deadline(timeout, watch))


def _waited_for(job: Callable[[], _Answer], stops: Stops, deadline: Deadline) -> _Answer:
    """Return the answer of a job in another thread, which is told to stop when it is time."""
    is_over = False
    with ThreadPoolExecutor(1) as pool:
        future = pool.submit(job)
        try:
            for stop, more in ((stops.looking, 0.0), (stops.proving, _GRACE)):
                if _is_done(future, deadline, more):
                    break
                stop[0] = 1
            answer = future.result()
            is_over = True
            return answer
        finally:
            if not is_over:
                for stop in stops:
                    stop[0] = 1


def _is_done(future: Future[_Answer], deadline: Deadline, more: float) -> bool:
    """Wait for an answer until so many seconds after a deadline; tell whether there is one."""
    while True:
        deadline.look()
        # In short turns: another thread may be the one that a signal wakes.
        rest = min(_TURN, more - deadline.late)
        if wait([future], max(rest, 0.0)).done:
            return True
        if rest < _TURN:
            return False
