"""Kernels that run beside whoever waits for them, so that they end in time or when told to."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor, wait
import math
import time
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.planning.edge_proofs import new_stop

__all__ = ["Stops", "run_stoppable"]

_Answer = TypeVar("_Answer")

_GRACE = 0.05
"""Seconds after the time is over in which what was found may still be proven."""


_TURN = 0.05
"""Seconds after which waiting looks whether a signal has come."""


class Stops(NamedTuple):
    """What is set to 1 when it is time to stop."""

    looking: NDArray[np.int64]
    """``(1,)``: look for nothing new."""
    proving: NDArray[np.int64]
    """``(1,)``: do nothing any more."""


def run_stoppable(
    job: Callable[[Stops], _Answer],
    timeout: float | None,
    watch: Callable[[], None] = lambda: None,
) -> _Answer:
    """Return what the job returns, which must look at its stops.

    It is told to stop after ``timeout`` (s), or where waiting ends in an exception, such as
    KeyboardInterrupt. ``watch`` is called now and then while it is waited for, and may raise one.
    """
    stops = Stops(new_stop(), new_stop())
    # Without time nothing is looked for, however soon the other thread begins.
    stops.looking[0] = int(timeout == 0.0)
    with ThreadPoolExecutor(1) as pool:
        future = pool.submit(job, stops)
        try:
            for stop, patience in ((stops.looking, timeout), (stops.proving, _GRACE)):
                if _is_done(future, patience, watch):
                    break
                stop[0] = 1
            return future.result()
        finally:
            for stop in stops:
                stop[0] = 1


def _is_done(future: Future[_Answer], patience: float | None, watch: Callable[[], None]) -> bool:
    """Wait for an answer, for so many seconds at most; tell whether there is one."""
    end = math.inf if patience is None else time.monotonic() + patience
    while True:
        watch()
        # In short turns: another thread may be the one that a signal wakes.
        rest = min(_TURN, end - time.monotonic())
        if wait([future], max(rest, 0.0)).done:
            return True
        if rest < _TURN:
            return False
