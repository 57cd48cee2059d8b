"""Connections of the view's server: how many there may be, how long they may be stuck."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterable, AsyncIterator, Coroutine, Sequence
import logging
from typing import Any

from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosed
from websockets.frames import CloseCode

from scene_graph_ros.views.browser.allowance import Allowance

__all__ = ["CLOSE_SECONDS", "Connections", "send", "silent", "until_first"]

CLOSE_SECONDS = 1.0
"""How long the other side may take to close a connection that has ended."""

MAX_CONNECTIONS = 64
"""Connections at a time, with those that fetch files or say nothing."""

_STUCK_SECONDS = 5.0
"""A page that takes nothing for so long is cut off."""

_FRAMES_PER_SECOND, _FRAMES_AT_ONCE = 100.0, 600.0
"""Frames that a client may send, be they messages, pieces of some, pings or nothing."""

_BYTES_BETWEEN_LOOKS = 2048
"""Bytes that are taken apart before it is looked how many frames they were."""

_FRAGMENT = 1 << 16
"""Bytes of a message that are copied for a client at once: the next when these have gone out."""


class Connections:
    """The connections that there are, and how many were refused or cut off."""

    def __init__(self) -> None:
        self.open: set[ServerConnection] = set()
        self.refused = 0
        """Requests that were not let in."""
        self.cut_off = 0
        """Clients that took nothing, or sent rubbish."""

    def connection(self, *arguments: Any, **options: Any) -> ServerConnection:
        """Return a connection that is counted here."""
        return _Counted(self, *arguments, **options)


class _Counted(ServerConnection):
    """A connection that is closed at once where there are too many.

    Also a while after it has come to its end, by agreement or by a forbidden message, if the
    other side does not close it.
    """

    def __init__(self, connections: Connections, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self._connections = connections
        self._is_ending = False
        self._frames = Allowance(_FRAMES_PER_SECOND, _FRAMES_AT_ONCE)
        self._sent_too_much = False

    def data_received(self, data: bytes) -> None:
        for start in range(0, len(data), _BYTES_BETWEEN_LOOKS):
            if self._is_ending:
                return
            super().data_received(data[start : start + _BYTES_BETWEEN_LOOKS])
            if self._sent_too_much and not self.protocol.close_expected():
                self.protocol.fail(CloseCode.POLICY_VIOLATION, "too many messages")
                self.send_data()
            self._end_if_over()

    def process_event(self, event: Any) -> None:
        self._sent_too_much |= self._frames.is_used_up()
        super().process_event(event)

    def _end_if_over(self) -> None:
        if self.protocol.close_expected() and not self._is_ending:
            self._is_ending = True
            self.loop.call_later(CLOSE_SECONDS, self.transport.abort)

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        self._connections.open.add(self)
        if len(self._connections.open) > MAX_CONNECTIONS:
            self._connections.refused += 1
            self.transport.abort()

    def connection_lost(self, exc: Exception | None) -> None:
        self._connections.open.discard(self)
        super().connection_lost(exc)


async def send(
    connection: ServerConnection,
    message: str | list[bytes] | tuple[bytes, ...] | AsyncIterable[bytes],
) -> None:
    """Send a text, or bytes in parts; raises TimeoutError where nothing is taken for long."""
    fragments = 0

    async def counted(parts: AsyncIterable[bytes]) -> AsyncIterator[bytes]:
        nonlocal fragments
        async for part in parts:
            fragments += 1
            yield part

    whole: str | bytes | AsyncIterable[bytes]
    if isinstance(message, str):
        whole = message
    elif isinstance(message, (list, tuple)):
        is_short = sum(map(len, message)) <= _FRAGMENT
        whole = b"".join(message) if is_short else counted(_cut(message))
    else:
        whole = counted(message)
    sending = asyncio.ensure_future(connection.send(whole))
    try:
        left = (0, -1)
        while not (await asyncio.wait([sending], timeout=_STUCK_SECONDS))[0]:
            before, left = left, (fragments, connection.transport.get_write_buffer_size())
            if left[0] == before[0] and 0 <= before[1] <= left[1]:
                raise TimeoutError
        await sending
    finally:
        sending.cancel()


async def _cut(parts: Sequence[bytes]) -> AsyncIterator[bytes]:
    for part in parts:
        view = memoryview(part)
        for start in range(0, len(part), _FRAGMENT):
            yield view[start : start + _FRAGMENT]  # type: ignore[misc]


async def until_first(
    sending: Coroutine[Any, Any, None], listening: Coroutine[Any, Any, None]
) -> None:
    """Do both until one has ended, and raise its error; the other ends with it."""
    tasks = [asyncio.ensure_future(work) for work in (sending, listening)]
    try:
        done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        if tasks[0] in done and isinstance(tasks[0].exception(), ConnectionClosed):
            # Who listens has still to read what came before that, and knows why it ended.
            await tasks[1]
        for task in reversed(tasks):
            if task.done():
                await task
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


def silent() -> logging.Logger:
    """Return a log that keeps nothing: strangers must not be able to fill one."""
    logger = logging.Logger("scene_graph_ros.browser", logging.CRITICAL + 1)
    logger.addHandler(logging.NullHandler())
    return logger
