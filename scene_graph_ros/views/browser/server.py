"""The server of the view: a page, and what that is sent, by a thread of its own."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
import contextlib
import logging
import socket
import threading
from typing import Any
from urllib.parse import urlencode

from websockets.asyncio.server import serve, ServerConnection
from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response

from scene_graph_ros.views.browser.gate import Gate
from scene_graph_ros.views.browser.pump import Page, Pump
from scene_graph_ros.views.browser.wishes import parse_wish, WishError
from scene_graph_ros.views.moment import Moment

__all__ = ["MAX_PAGES", "BrowserView"]

MAX_PAGES = 16
"""Pages at a time; more are answered that there are too many."""

_MAX_CONNECTIONS = 4 * MAX_PAGES
"""Connections at a time, with those that fetch files or say nothing."""

_MAX_WISH_BYTES = 1024
_MAX_WISHES_PER_SECOND = 20.0
"""A page has little to say. One that says more is cut off."""

_STUCK_SECONDS = 5.0
"""A page that takes nothing for so long is cut off."""

_OPEN_SECONDS = 5.0
"""How long a request may take to come."""

_CLOSE_SECONDS = 1.0
"""How long the other side may take to close a connection that has ended."""

_SEND_BUFFER = 1 << 18
"""Bytes that the system keeps for a page: what a slow page is behind."""

_CLOSE_RUBBISH = 1008
"""RFC 6455, 7.4.1: a message that violates the policy."""

_MAX_REASON_BYTES = 123
"""RFC 6455, 5.5: what is left of a frame that closes."""


class BrowserView:
    """Shows moments to whoever opens its page. Nothing is made while nobody does."""

    def __init__(
        self,
        host: str,
        port: int,
        *,
        rate: float,
        token: str = "",
        wanted: Callable[[], None] = lambda: None,
        failed: Callable[[Exception], None] = lambda error: None,
        cannot_show: Callable[[int, Exception], None] = lambda geometry_id, error: None,
    ) -> None:
        """Listen on a port of an address, 0 for a free one; raises OSError where that can't be.

        Pages get at most ``rate`` messages a second. ``wanted`` is called when one came and a
        moment is to be offered, ``failed`` with what went wrong, ``cannot_show`` with the id of
        what is left out and why: in threads of the view.
        """
        self._gate = Gate(host, token)
        self._wanted, self._failed = wanted, failed
        self._listener = _listen(host, port)
        number = self._listener.getsockname()[1]
        shown = f"[{host}]" if ":" in host else host
        self.address = f"http://{shown}:{number}/"
        self.link = self.address + (f"?{urlencode({'token': token})}" if token else "")
        """What to open: the address, with the token if there is one."""
        self._pump = Pump(rate, failed, cannot_show)
        self._loop = asyncio.new_event_loop()
        self._stopped = asyncio.Event()
        self._thread = threading.Thread(target=self._run, name="browser", daemon=True)
        self._is_ended = False
        self._connections: set[ServerConnection] = set()
        self._pages = 0
        self.refused = 0
        """Requests that were not let in."""
        self.cut_off = 0
        """Pages that took nothing, or sent rubbish."""

    def start(self) -> None:
        """Answer from now on."""
        self._pump.start()
        self._thread.start()

    def stop(self) -> None:
        """Close all pages and the port; what is being made for them ends by itself."""
        if self._is_ended:
            return
        self._is_ended = True
        self._pump.stop()
        if self._thread.ident is None:
            self._listener.close()
            self._loop.close()
            return
        self._call(self._stopped.set)
        self._thread.join()

    def end(self) -> None:
        """Do as ``stop``, and wait until its threads have ended."""
        self.stop()
        self._pump.join()

    def has_pages(self) -> bool:
        """Tell whether somebody looks."""
        return self._pump.count() > 0

    def wants_contacts(self) -> bool:
        """Tell whether somebody looks at what touches."""
        return self._pump.wants_contacts()

    def is_due(self) -> bool:
        """Tell whether a moment that is offered now goes out at once to some page."""
        return self._pump.is_due()

    def offer(self, moment: Moment) -> None:
        """Show a moment to all pages, unless a newer one comes before; returns at once."""
        self._pump.offer(moment)

    def recent_seconds(self) -> list[float]:
        """Return how long the last messages took to make."""
        return list(self._pump.seconds)

    def count(self) -> int:
        """Return how many messages were made."""
        return self._pump.messages

    def counters(self) -> dict[str, Any]:
        """Return who looks, and what was done for them."""
        return {
            "address": self.address,
            "pages": self._pump.count(),
            "messages": self._pump.messages,
            "bytes": self._pump.bytes,
            "requests refused": self.refused,
            "pages cut off": self.cut_off,
        }

    def _call(self, function: Callable[..., Any], *arguments: Any) -> None:
        """Have the thread of the server call a function, unless that has ended."""
        with contextlib.suppress(RuntimeError):
            self._loop.call_soon_threadsafe(function, *arguments)

    # In the thread of the server.

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        try:
            self._loop.run_until_complete(self._serve())
        except Exception as error:  # noqa: BLE001 - it never costs anything else
            self._failed(error)
        finally:
            self._listener.close()
            self._loop.close()

    async def _serve(self) -> None:
        server = serve(
            self._talk,
            sock=self._listener,
            process_request=self._answer,
            create_connection=self._connection,
            compression=None,
            server_header=None,
            open_timeout=_OPEN_SECONDS,
            close_timeout=_CLOSE_SECONDS,
            max_size=_MAX_WISH_BYTES,
            max_queue=4,
            logger=_silent(),
        )
        async with server:
            await self._stopped.wait()
            # Nobody is waited for: neither a page that is stuck nor who has not asked yet.
            for connection in list(self._connections):
                connection.transport.abort()
        others = asyncio.all_tasks() - {asyncio.current_task()}
        for task in others:
            task.cancel()
        await asyncio.gather(*others, return_exceptions=True)

    def _connection(self, *arguments: Any, **options: Any) -> ServerConnection:
        return _Counted(self, *arguments, **options)

    def _answer(self, connection: ServerConnection, request: Request) -> Response | None:
        hosts = request.headers.get_all("Host")
        origins = request.headers.get_all("Origin")
        if len(hosts) != 1 or len(origins) > 1:
            self.refused += 1
            return connection.respond(400, "One Host, and at most one Origin.\n")
        answer = self._gate.answer(request.path, hosts[0], origins[0] if origins else None)
        if answer is None:
            if self._pages < MAX_PAGES:
                return None
            self.refused += 1
            return connection.respond(503, f"There are {MAX_PAGES} pages already.\n")
        self.refused += answer.status >= 400
        headers = Headers(answer.headers())
        return Response(answer.status.value, answer.status.phrase, headers, answer.body)

    async def _talk(self, connection: ServerConnection) -> None:
        if self._pages >= MAX_PAGES:
            connection.transport.abort()
            return
        self._pages += 1
        outbox: asyncio.Queue[bytes] = asyncio.Queue()
        page = Page(lambda message: self._call(outbox.put_nowait, message))
        self._pump.add(page)
        self._wanted()
        sending = asyncio.ensure_future(self._send(connection, page, outbox))
        try:
            await self._listen_to(connection, page)
        finally:
            self._pages -= 1
            self._pump.remove(page)
            sending.cancel()
            await asyncio.gather(sending, return_exceptions=True)

    async def _send(
        self, connection: ServerConnection, page: Page, outbox: asyncio.Queue[bytes]
    ) -> None:
        with contextlib.suppress(ConnectionClosed):
            while True:
                message = await outbox.get()
                if not await _is_taken(connection, message):
                    self.cut_off += 1
                    connection.transport.abort()
                    return
                self._pump.sent(page)

    async def _listen_to(self, connection: ServerConnection, page: Page) -> None:
        allowance, last = _MAX_WISHES_PER_SECOND, self._loop.time()
        try:
            async for message in connection:
                now = self._loop.time()
                allowance = min(
                    allowance + (now - last) * _MAX_WISHES_PER_SECOND, _MAX_WISHES_PER_SECOND
                )
                allowance, last = allowance - 1.0, now
                if allowance < 0.0:
                    raise WishError("too many messages")
                if isinstance(message, bytes):
                    raise WishError("a message that is no text")
                self._pump.wish(page, parse_wish(message))
                self._wanted()
        except WishError as error:
            self.cut_off += 1
            reason = str(error).encode()[:_MAX_REASON_BYTES].decode(errors="ignore")
            await connection.close(_CLOSE_RUBBISH, reason)
        except ConnectionClosed as closed:
            # By us, because of what it sent.
            self.cut_off += closed.sent is not None and not closed.rcvd_then_sent


class _Counted(ServerConnection):
    """A connection that is closed at once where there are too many.

    Also a while after it has come to its end, by agreement or because of what was sent, if the
    other side does not close it.
    """

    def __init__(self, view: BrowserView, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self._view = view
        self._is_ending = False

    def data_received(self, data: bytes) -> None:
        super().data_received(data)
        if self.protocol.close_expected() and not self._is_ending:
            self._is_ending = True
            self.loop.call_later(_CLOSE_SECONDS, self.transport.abort)

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        self._view._connections.add(self)
        if len(self._view._connections) > _MAX_CONNECTIONS:
            self._view.refused += 1
            self.transport.abort()

    def connection_lost(self, exc: Exception | None) -> None:
        self._view._connections.discard(self)
        super().connection_lost(exc)


async def _is_taken(connection: ServerConnection, message: bytes) -> bool:
    """Send a message; tell whether the page has taken it, or at least goes on taking."""
    sending = asyncio.ensure_future(connection.send(message))
    try:
        left = -1
        while not (await asyncio.wait([sending], timeout=_STUCK_SECONDS))[0]:
            before, left = left, connection.transport.get_write_buffer_size()
            if before >= 0 and left >= before:
                return False
        await sending
    finally:
        sending.cancel()
    return True


def _listen(host: str, port: int) -> socket.socket:
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


def _silent() -> logging.Logger:
    """Return a log that keeps nothing: strangers must not be able to fill one."""
    logger = logging.Logger("scene_graph_ros.browser", logging.CRITICAL + 1)
    logger.addHandler(logging.NullHandler())
    return logger
