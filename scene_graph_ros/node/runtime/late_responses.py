"""Responses that also reach clients which the middleware has not met yet.

A request can come before discovery has told of the reader that its response is for: on a busy
machine the two are more than a tenth of a second apart. Fast DDS then says that nobody would get
the response, and rclpy warns and throws it away. Here it is kept and sent again until its client
is known: the middleware's return value is meant for that, say its authors (rmw_fastrtps, pull
request 467).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
import re
import threading
import time
import warnings

from rclpy.exceptions import InvalidHandle

from scene_graph_ros.node.runtime.own_threads import stop_at_exit

__all__ = ["LateResponses"]

_FIRST_PAUSE = 0.02
_PATIENCE = 10.0
"""Seconds between tries, twice as long after each, and in all: discovery takes less."""

_MOST_KEPT = 100
"""Responses: their clients may never become known, as where their quality of service does not
match. By then it is more likely that something asks so again and again."""

_NOT_SENT = (
    "error",
    re.compile("failed to send response", re.IGNORECASE),
    RuntimeWarning,
    re.compile(r"rclpy\.service\Z"),
    0,
)
"""A filter of warnings, as ``warnings.filterwarnings`` makes it."""

_filtering = threading.Lock()
"""A filter that is there already is taken out and put in again: others would send meanwhile."""


@dataclass
class _Late:
    """A response that waits for its client; times in steady seconds."""

    service: str
    send: Callable[[], None]
    at: float
    pause: float
    until: float


class LateResponses:
    """Sends responses of services, and again those that failed; safe from any thread.

    Its thread runs only while a response waits for its client.
    """

    def __init__(self, warn: Callable[[str], None], *, patience: float = _PATIENCE) -> None:
        """Tell ``warn`` of a response that is given up after ``patience`` seconds."""
        self._warn, self._patience = warn, patience
        self._changed = threading.Condition()
        self._kept: list[_Late] = []
        self._thread: threading.Thread | None = None
        self._is_closed = False
        stop_at_exit(self, LateResponses.close)

    def send(self, service: str, send: Callable[[], None]) -> None:
        """Send a response by ``send``, or keep it: ``service`` is the name to speak of."""
        if _is_sent(send):
            return
        now = time.monotonic()
        late = _Late(service, send, now + _FIRST_PAUSE, _FIRST_PAUSE, now + self._patience)
        with self._changed:
            if self._is_closed:
                return
            is_kept = len(self._kept) < _MOST_KEPT
            if is_kept:
                self._kept.append(late)
                self._changed.notify()
                if self._thread is None:
                    self._thread = threading.Thread(
                        target=self._run, name="late responses", daemon=True
                    )
                    self._thread.start()
        if not is_kept:
            self._give_up(late, f"{_MOST_KEPT} others wait for theirs already")

    def close(self) -> None:
        """Forget the waiting responses."""
        with self._changed:
            self._is_closed = True
            self._changed.notify()
            thread = self._thread
        if thread is not None and thread is not threading.current_thread():
            thread.join()

    def _run(self) -> None:
        while (late := self._next()) is not None:
            if self._is_done_with(late):
                with self._changed:
                    self._kept.remove(late)

    def _is_done_with(self, late: _Late) -> bool:
        """Try to send a response; tell whether it was sent or given up."""
        try:
            if _is_sent(late.send):
                return True
        except Exception as error:  # noqa: BLE001 - the others are still to be sent
            self._give_up(late, str(error))
            return True
        now = time.monotonic()
        if now >= late.until:
            self._give_up(late, f"it is not known after {self._patience:g} s")
            return True
        late.pause *= 2.0
        late.at = min(now + late.pause, late.until)
        return False

    def _next(self) -> _Late | None:
        """Wait for the next to try, which stays among those that are kept; None at the end."""
        with self._changed:
            while self._kept and not self._is_closed:
                late = min(self._kept, key=lambda kept: kept.at)
                remaining = late.at - time.monotonic()
                if remaining <= 0.0:
                    return late
                self._changed.wait(remaining)
            self._kept.clear()
            self._thread = None
            return None

    def _give_up(self, late: _Late, reason: str) -> None:
        self._warn(
            f"a response of {late.service} is dropped, the middleware does not know its client: "
            f"{reason}. Do the client's quality-of-service policies match those of services?"
        )


def _is_sent(send: Callable[[], None]) -> bool:
    """Send; return False where the middleware does not know the client."""
    # As an error, since a warning does not tell the caller. Whoever resets warnings, resets this.
    with _filtering:
        if _NOT_SENT not in warnings.filters:
            warnings.filterwarnings(
                "error", _NOT_SENT[1].pattern, RuntimeWarning, _NOT_SENT[3].pattern
            )
    try:
        send()
    except InvalidHandle:
        # The service is gone, and with it whoever could be answered.
        return True
    except SystemError as error:
        # So Python reports a warning raised by code that returned all the same.
        if not isinstance(error.__cause__, RuntimeWarning):
            raise
        return False
    return True
