"""Ends the process on SIGINT and SIGTERM, in order where that can be done and in time where not.

Python calls its signal handlers in the main thread, between two of its instructions: never, while
that thread compiles a kernel or waits for a lock. So a thread of its own reads the signals from a
pipe, into which the interpreter writes their numbers at once. Imports nothing that takes time, so
that signals are obeyed while the rest is imported.
"""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
import os
from pathlib import Path
import select
import signal
import sys
import threading
import time
from types import FrameType
from typing import NoReturn

__all__ = ["TIMEOUT", "Ending", "delays"]

TIMEOUT = 1.5
"""Seconds that an end in order may take, unless a parameter says otherwise."""

_ONE_SIGNAL = 0.2
"""Seconds. A process and its group are often signalled in one breath; that counts as one."""

_MOST_TIMES = 4.0
"""How many times as long an end may take where others have the processors."""

_TASKS = Path("/proc/self/task")

_SIGNALS = (signal.SIGINT, signal.SIGTERM)
_KILLED = 128
"""What shells add to the number of the signal that ended a process."""

_STANDARD_ERROR = 2
_PACKAGE = "scene_graph_ros"
_COMPILER = f"{_PACKAGE}.geometry.compiled."


class Ending:
    """Sets ``requested`` on the first signal, and ends the process ``timeout`` seconds later.

    The time for which a thread waits for a processor does not count, up to three times as much.

    A second signal ends it at once, and so does the first before `note_beginning`, when there is
    nothing yet to be ended in order.
    """

    def __init__(self) -> None:
        """Watch for signals from now on; to be made in the main thread."""
        self.requested = threading.Event()
        self.timeout = TIMEOUT
        self._has_begun = False
        self._reader, writer = os.pipe()
        os.set_blocking(writer, False)
        for number in _SIGNALS:
            signal.signal(number, _leave_it_to_the_watcher)
        signal.set_wakeup_fd(writer, warn_on_full_buffer=False)
        threading.Thread(target=self._watch, name="signals", daemon=True).start()

    def note_beginning(self) -> None:
        """Say that from now on there is something to end in order."""
        self._has_begun = True

    def exit(self, code: int) -> NoReturn:
        """End the process now that all is closed.

        To take the interpreter itself down takes a second, of which nobody has anything.
        """
        with contextlib.suppress(OSError):
            sys.stdout.flush()
            sys.stderr.flush()
        os._exit(code)

    def _watch(self) -> None:
        number = None
        while number is None:
            number = self._next_signal(None)
        if not self._has_begun:
            os._exit(0)
        begin, before = time.monotonic(), delays()
        self.requested.set()
        while (left := begin + self._allowed(before) - time.monotonic()) > 0.0:
            second = self._next_signal(left)
            if second is not None and time.monotonic() > begin + _ONE_SIGNAL:
                self._leave(number, f"{signal.Signals(second).name} came as well")
        self._leave(number, f"{self.timeout} s are over")

    def _allowed(self, before: dict[str, float]) -> float:
        """Return the seconds that the end may take, with those that a busy machine withholds."""
        withheld = max((now - before.get(k, 0.0) for k, now in delays().items()), default=0.0)
        return self.timeout + min(withheld, (_MOST_TIMES - 1.0) * self.timeout)

    def _next_signal(self, timeout: float | None) -> int | None:
        """Wait for a signal and return its number, None if none came in time."""
        if not select.select([self._reader], [], [], timeout)[0]:
            return None
        (number,) = os.read(self._reader, 1)
        return number if number in _SIGNALS else None

    @staticmethod
    def _leave(number: int, why: str) -> NoReturn:
        """End the process without waiting for anything."""
        unfinished = ", ".join(_what_threads_do()) or "nothing of this package"
        _say(
            f"scene_graph: {signal.Signals(number).name} ends the process now, as {why}; "
            f"unfinished: {unfinished}\n"
        )
        os._exit(_KILLED + number)


def delays(tasks: Path = _TASKS) -> dict[str, float]:
    """Return the time (s) that each thread could run and had no processor, by its number.

    Empty where the system does not say so.
    """
    found = {}
    with contextlib.suppress(OSError):
        for task in tasks.iterdir():
            # A thread may end meanwhile.
            with contextlib.suppress(OSError, ValueError, IndexError):
                found[task.name] = int((task / "schedstat").read_text().split()[1]) * 1e-9
    return found


def _leave_it_to_the_watcher(number: int, frame: FrameType | None) -> None:
    """Do nothing: the interpreter writes to the pipe because there is a handler."""


def _what_threads_do() -> Iterator[str]:
    """Yield the name of each other thread that is in a function of this package, and which."""
    frames = sys._current_frames()
    for thread in threading.enumerate():
        frame = frames.get(thread.ident or 0)
        while frame is not None and not _is_ours(frame):
            frame = frame.f_back
        if frame is not None and thread is not threading.current_thread():
            module = frame.f_globals["__name__"].removeprefix(f"{_PACKAGE}.")
            yield f"{thread.name} in {module}.{frame.f_code.co_qualname}"


def _is_ours(frame: FrameType) -> bool:
    """Tell whether a function is one of this package; how kernels are compiled tells nothing."""
    module = str(frame.f_globals.get("__name__", ""))
    return module.startswith(f"{_PACKAGE}.") and not module.startswith(_COMPILER)


def _say(text: str) -> None:
    """Write to standard error, unless whoever reads that is stuck."""
    with contextlib.suppress(OSError):
        if select.select([], [_STANDARD_ERROR], [], 0.0)[1]:
            os.write(_STANDARD_ERROR, text.encode()[: select.PIPE_BUF])
