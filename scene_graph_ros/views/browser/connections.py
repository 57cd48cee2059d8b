"""Connections of the view's server: how many there may be, how long they may be stuck."""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine
import logging
import socket
import time
from typing import Any

from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosed

__all__ = ["CLOSE_SECONDS", "Allowance", "Connections", "listen", "send", "silent", "until_first"]

CLOSE_SECONDS = 1.0
"""How long the other side may take to close a connection that has ended."""

MAX_CONNECTIONS = 64
"""Connections at a time, with those that fetch files or say nothing."""

_STUCK_SECONDS = 5.0
"""A page that takes nothing for so long is cut off."""

_SEND_BUFFER = 1 << 18
"""Bytes that the system keeps for a page: what a slow page is behind."""


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


class Allowance:
    """How many messages the other side may still send."""

    def __init__(self, per_second: float) -> None:
        """Allow as many at once as in each second."""
        self._most = self._left = per_second
        self._last = time.monotonic()

    def is_used_up(self) -> bool:
        """Take one message off; tell whether it was one too many."""
        now = time.monotonic()
        self._left = min(self._left + (now - self._last) * self._most, self._most) - 1.0
        self._last = now
        return self._left < 0.0


class _Counted(ServerConnection):
    """A connection that is closed at once where there are too many.

    Also a while after it has come to its end, by agreement or because of what was sent, if the
    other side does not close it.
    """

    def __init__(self, connections: Connections, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self._connections = connections
        self._is_ending = False

    def data_received(self, data: bytes) -> None:
        super().data_received(data)
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


async def send(connection: ServerConnection, message: str | bytes) -> None:
    """Send a message; raises TimeoutError where the other side takes nothing for long."""
    sending = asyncio.ensure_future(connection.send(message))
    try:
        left = -1
        while not (await asyncio.wait([sending], timeout=_STUCK_SECONDS))[0]:
            before, left = left, connection.transport.get_write_buffer_size()
            if before >= 0 and left >= before:
                raise TimeoutError
        await sending
    finally:
        sending.cancel()


async def until_first(
    sending: Coroutine[Any, Any, None], listening: Coroutine[Any, Any, None]
) -> None:
    """Do both until one has ended, and raise what that raises; the other ends with it."""
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


def listen(host: str, port: int) -> socket.socket:
    """Return a socket that listens; raises OSError where that can't be."""
    family, kind, protocol, _, address = socket.getaddrinfo(
        host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
    )[0]
    listener = socket.socket(family, kind, protocol)
    try:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        # Accepted connections inherit it.
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _SEND_BUFFER)
        listener.bind(address)
        # What connects before the server's thread is there waits for it.
        listener.listen()
    except OSError:
        listener.close()
        raise
    return listener


def silent() -> logging.Logger:
    """Return a log that keeps nothing: strangers must not be able to fill one."""
    logger = logging.Logger("scene_graph_ros.browser", logging.CRITICAL + 1)
    logger.addHandler(logging.NullHandler())
    return logger
