"""What is said between the server and one client that speaks Foxglove's protocol."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
import contextlib

from websockets.asyncio.server import ServerConnection

from scene_graph_ros.views.browser.assets import AssetError
from scene_graph_ros.views.browser.channels import Channels, Subscriber, TIME_PERIOD
from scene_graph_ros.views.browser.connections import Allowance, send, until_first
from scene_graph_ros.views.browser.foxglove import (
    asset_data,
    asset_error,
    parse_request,
    RequestError,
)

__all__ = ["talk_foxglove"]

_MAX_REQUESTS_PER_SECOND = 500.0
"""A client subscribes to channels one by one, and to all of them when it connects."""


async def talk_foxglove(connection: ServerConnection, channels: Channels) -> None:
    """Offer channels to a client and send what it subscribes to, until it leaves.

    Raises RequestError for rubbish, TimeoutError where it takes nothing for long.
    """
    loop, ready = asyncio.get_running_loop(), asyncio.Event()

    def wake() -> None:
        # From other threads; the loop may have ended.
        with contextlib.suppress(RuntimeError):
            loop.call_soon_threadsafe(ready.set)

    subscriber = channels.join(wake)
    # One file waits at most, and whoever asks for more is not listened to meanwhile.
    files: asyncio.Queue[bytes] = asyncio.Queue(1)

    async def answer(request: int, address: str) -> None:
        await files.put(await asyncio.to_thread(_asset, channels, request, address))
        ready.set()

    try:
        await until_first(
            _send(connection, subscriber, ready, files), _listen(connection, subscriber, answer)
        )
    finally:
        subscriber.leave()


def _asset(channels: Channels, request: int, address: str) -> bytes:
    """Return what a request for a file is answered."""
    if channels.assets is None:
        return asset_error(request, "this server does not offer fetchAsset")
    try:
        return asset_data(request, channels.assets(address))
    except AssetError as error:
        return asset_error(request, str(error))


async def _send(
    connection: ServerConnection,
    subscriber: Subscriber,
    ready: asyncio.Event,
    files: asyncio.Queue[bytes],
) -> None:
    while True:
        ready.clear()
        while (message := subscriber.take()) is not None:
            await send(connection, message)
            if not files.empty():
                break
        if not files.empty():
            await send(connection, files.get_nowait())
            continue
        with contextlib.suppress(TimeoutError):
            await asyncio.wait_for(ready.wait(), TIME_PERIOD if subscriber.tells_time else None)


async def _listen(
    connection: ServerConnection,
    subscriber: Subscriber,
    answer: Callable[[int, str], Awaitable[None]],
) -> None:
    allowance = Allowance(_MAX_REQUESTS_PER_SECOND)
    async for message in connection:
        if allowance.is_used_up():
            raise RequestError("too many messages")
        if isinstance(message, bytes):
            raise RequestError("a message that is no text: clients may not publish here")
        request = parse_request(message)
        for subscription, channel in request.subscribe:
            subscriber.subscribe(subscription, channel)
        for subscription in request.unsubscribe:
            subscriber.unsubscribe(subscription)
        if request.asset is not None:
            await answer(*request.asset)
        if request.not_offered:
            subscriber.complain(f"this server does not offer {request.not_offered}")
