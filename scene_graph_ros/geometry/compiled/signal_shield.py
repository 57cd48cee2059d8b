"""Work that must not be interrupted is done in a thread that no signal reaches.

Numba reads its registries when it first compiles or loads a kernel, and takes off each the entries
that it has read. An exception in between, such as Ctrl-C, leaves a process in which some functions
have no meaning any more. Signals are delivered to the main thread alone, which here only waits.
"""

from __future__ import annotations

from collections.abc import Callable
import threading
from typing import Any

from numba.core.compiler_lock import global_compiler_lock

__all__ = ["shielded"]


def shielded(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function that compiles, made to end in spite of signals meanwhile.

    The exception of a signal leaves the call at once, and the thread goes on to its end.
    """

    def ask(*arguments: Any) -> Any:
        is_main = threading.current_thread() is threading.main_thread()
        # Who compiles something around it holds the lock, which the thread would wait for.
        if not is_main or global_compiler_lock.is_locked():
            return function(*arguments)
        found: list[Any] = []
        failed: list[BaseException] = []

        def run() -> None:
            try:
                found.append(function(*arguments))
            except BaseException as error:  # noqa: BLE001 - raised by whoever waits
                failed.append(error)

        thread = threading.Thread(target=run, name="compile")
        thread.start()
        thread.join()
        if failed:
            raise failed[0]
        return found[0]

    return ask
