"""Work that waits for a thread, in the order in which it came; pure bookkeeping, without ROS."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
import itertools
import threading

from msg_adapters.errors import TooLargeError

__all__ = ["Backlog", "Work"]


@dataclass(frozen=True, eq=False)
class Work:
    """Something to do; ``number`` says when it came."""

    number: int
    do: Callable[[], None]
    is_exclusive: bool = False
    size: int = 0
    """Bytes, of a request that came when others waited."""


class Backlog:
    """Gives out work, several pieces at once, exclusive ones in turn; safe from any thread."""

    def __init__(self, *, at_once: int, most_requests: Callable[[], int], most_bytes: int) -> None:
        """Have ``at_once`` done together, and so many requests waiting of so many bytes."""
        self._at_once = at_once
        self._most_requests, self._most_bytes = most_requests, most_bytes
        self._lock = threading.Lock()
        self._numbers = itertools.count()
        self._ordinary: deque[Work] = deque()
        self._exclusive: deque[Work] = deque()
        self._running = 0
        self._is_exclusive_running = False
        self._requests: set[Work] = set()
        self._bytes = 0

    def add(self, do: Callable[[], None]) -> None:
        """Add something that is no request, however much waits already."""
        with self._lock:
            self._ordinary.append(Work(next(self._numbers), do))

    def add_request(
        self, do: Callable[[], None], size: Callable[[], int], *, is_exclusive: bool
    ) -> None:
        """Add a request; ``size`` returns its bytes, and is asked only where others wait.

        Raises TooLargeError, and forgets it, where it would be too much.
        """
        with self._lock:
            count, limit = len(self._requests), self._most_requests()
            if count >= limit:
                raise TooLargeError(
                    f"{count} requests wait already, and max_waiting_requests is {limit}"
                )
            more = size() if count else 0
            if self._bytes + more > self._most_bytes:
                raise TooLargeError(
                    f"requests of {self._bytes} bytes wait already; with {more} more they are "
                    f"over the limit, which is {self._most_bytes}"
                )
            work = Work(next(self._numbers), do, is_exclusive, more)
            (self._exclusive if is_exclusive else self._ordinary).append(work)
            self._requests.add(work)
            self._bytes += more

    def take(self) -> Work | None:
        """Return the next work; None where nothing may begin now.

        At its end, call ``done``.
        """
        with self._lock:
            if self._running >= self._at_once:
                return None
            queues = [self._ordinary]
            if not self._is_exclusive_running:
                queues.append(self._exclusive)
            waiting = [queue for queue in queues if queue]
            if not waiting:
                return None
            work = min(waiting, key=lambda queue: queue[0].number).popleft()
            self._running += 1
            self._requests.discard(work)
            self._bytes -= work.size
            self._is_exclusive_running |= work.is_exclusive
            return work

    def done(self, work: Work) -> None:
        """Take note that something was done, well or not."""
        with self._lock:
            self._running -= 1
            if work.is_exclusive:
                self._is_exclusive_running = False
