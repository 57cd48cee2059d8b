"""The conversation of the server with one client that speaks Foxglove's protocol."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable
import contextlib
from typing import NamedTuple

from websockets.asyncio.server import ServerConnection

from scene_graph_ros.views.browser.allowance import Allowance, Pace
from scene_graph_ros.views.browser.assets import Asset, AssetError, FRAGMENT
from scene_graph_ros.views.browser.channels import Channels, Subscriber, TIME_PERIOD
from scene_graph_ros.views.browser.connections import send, until_first
from scene_graph_ros.views.browser.foxglove import (
    asset_error,
    asset_head,
    parse_request,
    RequestError,
)
from scene_graph_ros.views.browser.waiting import Load

__all__ = ["pace_of_files", "talk_foxglove"]

_REQUESTS_PER_SECOND, _REQUESTS_AT_ONCE = 20.0, 500.0
"""A client subscribes to channels one by one, and to all of them when it connects."""

_FILES_PER_SECOND, _FILES_AT_ONCE = 50.0, 200.0
"""More requests of a client for files wait, and it is not listened to meanwhile."""

_FILE_BYTES_PER_SECOND = float(1 << 26)
"""Of files that all clients together are sent, 64 MiB."""


def pace_of_files() -> Pace:
    """Return the pace of files, for all clients together."""
    return Pace(_FILE_BYTES_PER_SECOND)


class _Answer(NamedTuple):
    """The answer to a request for a file."""

    head: bytes
    asset: Asset | None = None


async def talk_foxglove(connection: ServerConnection, channels: Channels, pace: Pace) -> None:
    """Offer channels to a client and send its subscriptions, until it leaves.

    ``pace`` is that of files. Raises RequestError for rubbish, TimeoutError where the client takes
    nothing for long, AssetError where a file goes while it is sent.
    """
    loop, ready = asyncio.get_running_loop(), asyncio.Event()

    def wake() -> None:
        # From other threads; the loop may have ended.
        with contextlib.suppress(RuntimeError):
            loop.call_soon_threadsafe(ready.set)

    def cut_off() -> None:
        with contextlib.suppress(RuntimeError):
            loop.call_soon_threadsafe(connection.transport.abort)

    subscriber = channels.join(wake, cut_off)
    # One file waits at most, and whoever asks for more is not listened to meanwhile.
    files: asyncio.Queue[_Answer] = asyncio.Queue(1)
    requests = Pace(_FILES_PER_SECOND, _FILES_AT_ONCE)

    is_over = False

    async def answer(request: int, address: str) -> None:
        await requests.wait()
        if not is_over:
            await files.put(await asyncio.to_thread(_asset, channels, request, address))
        ready.set()

    async def sending() -> None:
        nonlocal is_over
        try:
            await _send(connection, subscriber, ready, files, pace)
        finally:
            # Whoever listens must not wait for a file to go out.
            is_over = True
            while not files.empty():
                files.get_nowait()

    try:
        await until_first(
            sending(),
            _listen(connection, subscriber, answer),
        )
    finally:
        subscriber.leave()


def _asset(channels: Channels, request: int, address: str) -> _Answer:
    """Return the answer to a request for a file."""
    if channels.assets is None:
        return _Answer(asset_error(request, "this server does not offer fetchAsset"))
    try:
        return _Answer(asset_head(request), channels.assets(address))
    except AssetError as error:
        return _Answer(asset_error(request, str(error)))


async def _parts(answer: _Answer, pace: Pace) -> AsyncIterator[bytes]:
    """Yield an answer in parts; each is read when the one before has gone out."""
    yield answer.head
    if answer.asset is not None:
        fragments = answer.asset.fragments()
        while (part := await asyncio.to_thread(next, fragments, None)) is not None:
            await pace.wait(len(part))
            yield part


async def _send(
    connection: ServerConnection,
    subscriber: Subscriber,
    ready: asyncio.Event,
    files: asyncio.Queue[_Answer],
    pace: Pace,
) -> None:
    fragment = Load(FRAGMENT)
    while True:
        ready.clear()
        while (message := subscriber.take()) is not None:
            await send(connection, message)
            if not files.empty():
                break
        if not files.empty():
            subscriber.is_sent(fragment)
            await send(connection, _parts(files.get_nowait(), pace))
            continue
        with contextlib.suppress(TimeoutError):
            await asyncio.wait_for(ready.wait(), TIME_PERIOD if subscriber.tells_time else None)


async def _listen(
    connection: ServerConnection,
    subscriber: Subscriber,
    answer: Callable[[int, str], Awaitable[None]],
) -> None:
    allowance = Allowance(_REQUESTS_PER_SECOND, _REQUESTS_AT_ONCE)
    async for message in connection:
        if isinstance(message, bytes):
            raise RequestError("a message that is no text: clients may not publish here")
        request = parse_request(message)
        if request.asset is None and allowance.is_used_up():
            raise RequestError("too many messages")
        for subscription, channel in request.subscribe:
            subscriber.subscribe(subscription, channel)
        for subscription in request.unsubscribe:
            subscriber.unsubscribe(subscription)
        if request.asset is not None:
            await answer(*request.asset)
        if request.not_offered:
            subscriber.complain(f"this server does not offer {request.not_offered}")
