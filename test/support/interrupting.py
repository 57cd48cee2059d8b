"""Interrupts at any instruction: Ctrl-C comes wherever it likes, so tests try many places.

An instruction is an opcode of the interpreter, in any frame that runs while something is done. A
trace function raises KeyboardInterrupt before the k-th of them. That is harsher than a signal,
which the interpreter looks at only between some of them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import _base as futures_base
from concurrent.futures import thread as futures_thread
import contextlib
import gc
import queue
import random
import signal
import sys
import threading
from types import FrameType
from typing import Any

from searching import times

__all__ = ["SAMPLE", "instruction_count", "interrupted_at", "places", "signalled_at"]

_WITH_LOCKS = {threading.__file__, futures_thread.__file__, futures_base.__file__, queue.__file__}
"""Modules of the standard library that hold locks."""

_SOON = 2e-6
"""s: as long as some instructions take."""

SAMPLE = 20
"""Instructions that are tried of each action, where a run of all tests does; else `times` more."""


class _Tracer:
    """Counts instructions, and interrupts one of them."""

    def __init__(self, at: int, error: type[BaseException]) -> None:
        self.count = 0
        self._at, self._error = at, error

    def call(self, frame: FrameType, event: str, argument: Any) -> Any:
        """Trace a frame's instructions instead of its lines, but for those of threads and locks.

        No signal comes between a lock and the block after ``with``; were one raised there, the
        process could start no thread any more.
        """
        if frame.f_code.co_filename in _WITH_LOCKS:
            return None
        frame.f_trace_opcodes, frame.f_trace_lines = True, False
        return self.step

    def step(self, frame: FrameType, event: str, argument: Any) -> Any:
        """Count an instruction, and interrupt it if it is the one."""
        if event == "opcode":
            if self.count == self._at:
                sys.settrace(None)
                raise self._error
            self.count += 1
        return self.step


@contextlib.contextmanager
def _uncollected() -> Iterator[None]:
    """Have no garbage collected: the collector calls others' functions, and keeps their errors.

    Hypothesis has one called before and after. An interrupt that came there would be lost.
    """
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()


@_uncollected()
def _run(
    action: Callable[[], Any], at: int, error: type[BaseException] = KeyboardInterrupt
) -> tuple[bool, int]:
    before, tracer = sys.gettrace(), _Tracer(at, error)
    sys.settrace(tracer.call)
    try:
        action()
    except error:
        return True, tracer.count
    except (TypeError, SystemError):
        # NumPy answers an interrupt inside of a comparison of records with a TypeError of its own,
        # numba one inside of Python code that reads what a kernel returns with a SystemError.
        if tracer.count != at:
            raise
        return True, tracer.count
    finally:
        sys.settrace(before)
    return False, tracer.count


def instruction_count(action: Callable[[], Any]) -> int:
    """Count the instructions that an action takes; it is done."""
    return _run(action, -1)[1]


def interrupted_at(
    action: Callable[[], Any], at: int, error: type[BaseException] = KeyboardInterrupt
) -> bool:
    """Begin an action and interrupt it at an instruction; tell whether it came so far."""
    return _run(action, at, error)[0]


@_uncollected()
def signalled_at(action: Callable[[], Any], at: int) -> bool:
    """Begin an action, have a signal come just after an instruction; tell whether it ended it.

    The handler raises KeyboardInterrupt where the interpreter calls it, as that of Ctrl-C does.
    """

    def ring(number: int, frame: FrameType | None) -> None:
        raise KeyboardInterrupt

    def step(frame: FrameType, event: str, argument: Any) -> Any:
        nonlocal left
        if event == "opcode":
            left -= 1
            if left < 0:
                sys.settrace(None)
                signal.setitimer(signal.ITIMER_REAL, _SOON)
        return step

    def call(frame: FrameType, event: str, argument: Any) -> Any:
        frame.f_trace_opcodes, frame.f_trace_lines = True, False
        return step

    left, before, tracer = at, signal.getsignal(signal.SIGALRM), sys.gettrace()
    clock = signal.getitimer(signal.ITIMER_REAL)  # of who waits for the test
    signal.signal(signal.SIGALRM, ring)
    sys.settrace(call)
    try:
        action()
        signal.setitimer(signal.ITIMER_REAL, 0.0)  # One that has come is handled here at last.
    except KeyboardInterrupt:
        return True
    finally:
        sys.settrace(tracer)
        signal.signal(signal.SIGALRM, before)
        signal.setitimer(signal.ITIMER_REAL, *clock)
    return False


def places(count: int, seed: str, sample: int = SAMPLE, searched: int = SAMPLE) -> Iterator[int]:
    """Return instructions to try of so many: a sample, or all where a search has the time.

    A search takes `times` ``searched`` of them, however few of a slow action `make test` does.
    """
    most = sample if times(1) == 1 else times(searched)
    if most >= count:
        return iter(range(count))
    chosen = random.Random(seed).sample(range(count), most)
    return iter(sorted(chosen))
