"""The server of the view: a page and its messages, by a thread of its own."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable, Sequence
import contextlib
import threading
from typing import Any
from urllib.parse import urlencode

from websockets.asyncio.server import serve, ServerConnection
from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response
from websockets.typing import Subprotocol

from scene_graph_ros.views.browser.allowance import Allowance
from scene_graph_ros.views.browser.assets import AssetError
from scene_graph_ros.views.browser.channels import Channels
from scene_graph_ros.views.browser.connections import (
    CLOSE_SECONDS,
    Connections,
    send,
    silent,
    until_first,
)
from scene_graph_ros.views.browser.cursor import Told
from scene_graph_ros.views.browser.foxglove import RequestError, SUBPROTOCOLS
from scene_graph_ros.views.browser.foxglove_talk import pace_of_files, talk_foxglove
from scene_graph_ros.views.browser.gate import Gate
from scene_graph_ros.views.browser.listener import listen
from scene_graph_ros.views.browser.motion_requests import MotionRequest
from scene_graph_ros.views.browser.motions import MotionTold, PageMotion
from scene_graph_ros.views.browser.pump import Page, Pump
from scene_graph_ros.views.browser.waiting import Load
from scene_graph_ros.views.browser.wishes import Move, parse_wish, Wish, WishError
from scene_graph_ros.views.moment import Moment

__all__ = ["MAX_PAGES", "BrowserView"]

MAX_PAGES = 16
"""Pages and other clients at a time; more are answered that there are too many."""

_MAX_WISH_BYTES = 1024
_MAX_WISHES_PER_SECOND = 40.0
"""A page has little to say. One that says more is cut off."""

_MAX_REQUEST_BYTES = 1 << 15
"""What other clients say in one message: a thousand subscriptions."""

_OPEN_SECONDS = 5.0
"""How long a request may take to come."""

_CLOSE_RUBBISH = 1008
"""RFC 6455, 7.4.1: a message that violates the policy."""

_MAX_REASON_BYTES = 123
"""RFC 6455, 5.5: what is left of a frame that closes."""


class BrowserView:
    """Shows moments to whoever opens its page. Nothing is made while nobody does.

    Clients that speak Foxglove's protocol get the channels that somebody else writes to.
    """

    def __init__(
        self,
        host: str,
        port: int,
        *,
        rate: float,
        token: str = "",
        origins: Iterable[str] = (),
        channels: Channels | None = None,
        wanted: Callable[[], None] = lambda: None,
        failed: Callable[[Exception], None] = lambda error: None,
        cannot_show: Callable[[int, Exception], None] = lambda geometry_id, error: None,
        refused_origin: Callable[[str], None] = lambda origin: None,
        moved: Callable[[Move], None] | None = None,
        motions: Callable[[Callable[[MotionTold], None]], PageMotion] | None = None,
        no_handles: Callable[[OSError], None] = lambda error: None,
    ) -> None:
        """Listen on a port of an address, 0 for a free one; raises OSError where that can't be.

        Pages get at most ``rate`` messages a second. ``wanted`` is called when one came and a
        moment is to be offered, ``failed`` with the error, ``cannot_show`` with the id of a
        geometry that is left out and why, ``refused_origin`` with that of a refused page: in
        threads of the view. Pages of other ``origins`` may connect, too. ``moved`` is called with
        joints that pages move, ``motions`` with a page's listener before its first request about
        a tool; without them they may not. ``no_handles`` is told where the system has no file
        handle for one more connection, each second.
        """
        self._gate = Gate(host, token, origins, refused_origin)
        self._channels = Channels("", str) if channels is None else channels
        self._wanted, self._failed, self._moved = wanted, failed, moved
        self._motions = motions
        self._listener = listen(host, port)
        self._listener.no_handles = no_handles
        self._pace = pace_of_files()
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
        self._connections = Connections()
        self._clients = 0

    def start(self) -> None:
        """Answer from now on."""
        self._pump.start()
        self._thread.start()

    def stop(self) -> None:
        """Close all pages and the port; messages that are being made end by themselves."""
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
        """Tell whether somebody looks at contacts."""
        return self._pump.wants_contacts()

    def is_due(self) -> bool:
        """Tell whether a moment that is offered now goes out at once to some page."""
        return self._pump.is_due()

    def offer(self, moment: Moment) -> None:
        """Show a moment to all pages, unless a newer one comes before; returns at once."""
        self._pump.offer(moment)

    def recent_seconds(self) -> list[float]:
        """Return the times (s) that the last messages took to make."""
        return list(self._pump.seconds)

    def count(self) -> int:
        """Return the number of messages made."""
        return self._pump.messages

    def counters(self) -> dict[str, Any]:
        """Return the address, the number of open pages, and counts of messages to them."""
        return {
            "address": self.address,
            "pages": self._pump.count(),
            "messages": self._pump.messages,
            "bytes": self._pump.bytes,
            "Foxglove clients": len(self._channels.subscribers),
            "Foxglove messages": self._channels.sent,
            "Foxglove messages dropped, as clients were slow": self._channels.dropped,
            "bytes that wait": self._channels.waiting.bytes,
            "requests refused": self._connections.refused,
            "connections refused, as they came too fast": self._listener.refused,
            "clients cut off": self._connections.cut_off,
        }

    def _call(self, function: Callable[..., Any], *arguments: Any) -> None:
        """Have the thread of the server call a function, unless that has ended."""
        with contextlib.suppress(RuntimeError):
            self._loop.call_soon_threadsafe(function, *arguments)

    # In the thread of the server.

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        self._loop.set_exception_handler(self._say_fault)
        try:
            self._loop.run_until_complete(self._serve())
        except Exception as error:  # noqa: BLE001 - it never costs anything else
            self._failed(error)
        finally:
            self._listener.close()
            self._loop.close()

    def _say_fault(self, loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        """Report an error of the loop, but for the listener's, which reports its own."""
        if "socket" not in context or not isinstance(context.get("exception"), OSError):
            loop.default_exception_handler(context)

    async def _serve(self) -> None:
        server = serve(
            self._talk,
            sock=self._listener,
            process_request=self._answer,
            create_connection=self._connections.connection,
            select_subprotocol=_choose,
            compression=None,
            server_header=None,
            open_timeout=_OPEN_SECONDS,
            close_timeout=CLOSE_SECONDS,
            max_size=_MAX_WISH_BYTES,
            max_queue=4,
            logger=silent(),
        )
        async with server:
            await self._stopped.wait()
            # Wait neither for a page that is stuck nor for one that has not asked yet.
            for connection in list(self._connections.open):
                connection.transport.abort()
        others = asyncio.all_tasks() - {asyncio.current_task()}
        for task in others:
            task.cancel()
        await asyncio.gather(*others, return_exceptions=True)

    def _answer(self, connection: ServerConnection, request: Request) -> Response | None:
        hosts = request.headers.get_all("Host")
        origins = request.headers.get_all("Origin")
        if len(hosts) != 1 or len(origins) > 1:
            self._connections.refused += 1
            return connection.respond(400, "One Host, and at most one Origin.\n")
        offered = ",".join(request.headers.get_all("Sec-WebSocket-Protocol")).split(",")
        is_other = _choose(None, [name.strip() for name in offered]) is not None
        answer = self._gate.answer(
            request.path, hosts[0], origins[0] if origins else None, is_other=is_other
        )
        if answer is None:
            if self._clients < MAX_PAGES:
                if is_other:
                    connection.protocol.max_message_size = _MAX_REQUEST_BYTES
                return None
            self._connections.refused += 1
            return connection.respond(503, f"There are {MAX_PAGES} pages already.\n")
        self._connections.refused += answer.status >= 400
        headers = Headers(answer.headers())
        return Response(answer.status.value, answer.status.phrase, headers, answer.body)

    async def _talk(self, connection: ServerConnection) -> None:
        if self._clients >= MAX_PAGES:
            connection.transport.abort()
            return
        self._clients += 1
        try:
            if connection.subprotocol is None:
                await self._talk_to_page(connection)
            else:
                await talk_foxglove(connection, self._channels, self._pace)
        except (WishError, RequestError) as rubbish:
            self._connections.cut_off += 1
            reason = str(rubbish).encode()[:_MAX_REASON_BYTES].decode(errors="ignore")
            await connection.close(_CLOSE_RUBBISH, reason)
        except (TimeoutError, AssetError):
            self._connections.cut_off += 1
            connection.transport.abort()
        except ConnectionClosed as closed:
            # By us, because of what it sent.
            self._connections.cut_off += closed.sent is not None and not closed.rcvd_then_sent
        finally:
            self._clients -= 1

    async def _talk_to_page(self, connection: ServerConnection) -> None:
        """Send the scene and listen to wishes, until the page leaves."""
        outbox: asyncio.Queue[Told] = asyncio.Queue()
        waiting = self._channels.waiting

        def deliver(told: Told) -> None:
            load = Load(told.own_bytes)
            waiting.begin(page, load, lambda: self._call(connection.transport.abort))
            self._call(outbox.put_nowait, told)

        page = Page(deliver)
        self._pump.add(page)
        self._wanted()
        motion = _LateMotion(self._motions, lambda told: self._pump.tell_motion(page, told))
        try:
            await until_first(
                self._send(connection, page, outbox), self._listen(connection, page, motion)
            )
        finally:
            motion.close()
            self._pump.remove(page)
            waiting.end(page)

    async def _send(
        self, connection: ServerConnection, page: Page, outbox: asyncio.Queue[Told]
    ) -> None:
        while True:
            await send(connection, (await outbox.get()).blocks)
            self._channels.waiting.end(page)
            self._pump.sent(page)

    async def _listen(self, connection: ServerConnection, page: Page, motion: _LateMotion) -> None:
        allowance = Allowance(_MAX_WISHES_PER_SECOND)
        async for message in connection:
            if allowance.is_used_up():
                raise WishError("too many messages")
            if isinstance(message, bytes):
                raise WishError("a message that is no text")
            wish = parse_wish(message)
            if isinstance(wish, Wish):
                self._pump.wish(page, wish)
                self._wanted()
            elif isinstance(wish, Move):
                if self._moved is None:
                    raise WishError("joints can't be moved here")
                self._moved(wish)
            else:
                motion.ask(wish)


class _LateMotion:
    """A page's session with robots, made when it first asks for something."""

    def __init__(
        self,
        make: Callable[[Callable[[MotionTold], None]], PageMotion] | None,
        tell: Callable[[MotionTold], None],
    ) -> None:
        self._make, self._tell = make, tell
        self._motion: PageMotion | None = None

    def ask(self, request: MotionRequest) -> None:
        """Hand a request on. Raises WishError where pages may not ask for motions."""
        if self._make is None:
            raise WishError("robots can't be moved here")
        if self._motion is None:
            self._motion = self._make(self._tell)
        self._motion.ask(request)

    def close(self) -> None:
        """End it, if there is one."""
        if self._motion is not None:
            self._motion.close()


def _choose(_: Any, offered: Sequence[str]) -> Subprotocol | None:
    """Return the protocol that a client gets; None: it is the page."""
    return next((Subprotocol(name) for name in SUBPROTOCOLS if name in offered), None)
