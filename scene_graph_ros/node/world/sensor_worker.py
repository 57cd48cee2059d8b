"""Where messages of sensors are looked at: in a thread beside the updates, or at once."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, Protocol

__all__ = ["AtOnce", "SensorWorker", "ToldWorker", "Worker"]


class Worker(Protocol):
    """Calls functions some time."""

    is_at_once: bool
    """Whether that is in `start`."""

    def start(self, work: Callable[[], Any]) -> Future[Any]:
        """Have a function called; return its result to come."""


def _call_for(work: Callable[[], Any], future: Future[Any]) -> None:
    try:
        future.set_result(work())
    except Exception as error:  # noqa: BLE001 - raised again by whoever asks for the result
        future.set_exception(error)


class AtOnce:
    """Calls functions at once: a look takes no time, as far as updates know."""

    is_at_once = True

    def start(self, work: Callable[[], Any]) -> Future[Any]:
        """Call a function; return its result."""
        future: Future[Any] = Future()
        _call_for(work, future)
        return future


class SensorWorker:
    """One thread that calls functions in their order; none before the first is started."""

    is_at_once = False

    def __init__(self, done: Callable[[], None]) -> None:
        """Call ``done``, in that thread, when a result has come."""
        self._done = done
        self._pool: ThreadPoolExecutor | None = None

    def start(self, work: Callable[[], Any]) -> Future[Any]:
        """Have a function called; return its result to come."""
        if self._pool is None:
            self._pool = ThreadPoolExecutor(1, "sensors")
        future = self._pool.submit(work)
        future.add_done_callback(lambda _: self._done())
        return future

    def close(self) -> None:
        """End the thread after its present function; nobody waits for it."""
        if self._pool is not None:
            self._pool.shutdown(wait=False, cancel_futures=True)
            self._pool = None


class ToldWorker:
    """Calls a function when it is told to, for replays: one at a time."""

    is_at_once = False

    def __init__(self) -> None:
        self._waiting: tuple[Callable[[], Any], Future[Any]] | None = None

    def start(self, work: Callable[[], Any]) -> Future[Any]:
        """Keep a function until `finish`; return its result to come."""
        self._waiting = work, Future()
        return self._waiting[1]

    def finish(self) -> None:
        """Call the function that waits, if there is one."""
        if self._waiting is not None:
            (work, future), self._waiting = self._waiting, None
            _call_for(work, future)
