"""Clients of a node's page, good and bad: pages, Foxglove's, slow ones and storms.

    python -m benchmarks.messages.page_clients http://127.0.0.1:8780/

Runs until it is interrupted. Who is cut off, or refused, comes again.
"""

from __future__ import annotations

from collections.abc import Callable
import contextlib
import json
import signal
import socket
import sys
import threading
import time
from urllib.parse import urlsplit

from websockets.exceptions import WebSocketException
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Subprotocol

_FOXGLOVE = Subprotocol("foxglove.websocket.v1")
_PING = b"\x89\x80\0\0\0\0"
"""RFC 6455, 5.2: masked, and without content."""

_PAUSE = 0.1
"""Seconds until somebody who was cut off comes again; storms make none."""


def _page(address: str) -> None:
    """Look at everything, contacts too."""
    with connect(f"ws{address[4:]}scene", max_size=None, proxy=None) as client:
        client.send(json.dumps({"roles": ["illustration"], "contacts": True, "camera": "eye"}))
        for _ in client:
            pass


def _subscriber(address: str) -> None:
    """Subscribe to all that is offered, images of the camera among it."""
    with _foxglove(address) as client:
        for message in client:
            if isinstance(message, str) and json.loads(message)["op"] == "advertise":
                _subscribe(client, message)


def _stuck(address: str) -> None:
    """Subscribe to everything, ask for files, and read nothing."""
    with _foxglove(address, max_queue=1) as client:
        for number in range(20):
            client.send(json.dumps({"op": "fetchAsset", "uri": "file:///x", "requestId": number}))
        for _ in range(2):
            message = client.recv()
            if isinstance(message, str) and json.loads(message)["op"] == "advertise":
                _subscribe(client, message)
        while client.state.name == "OPEN":
            time.sleep(_PAUSE)


def _pings(address: str) -> None:
    """Send pings as fast as they are taken."""
    with connect(f"ws{address[4:]}scene", max_queue=1, proxy=None) as client:
        while True:
            client.socket.sendall(_PING * 1000)


def _storm(address: str) -> None:
    """Connect and leave as fast as it goes."""
    parts = urlsplit(address)
    while True:
        with contextlib.suppress(OSError):
            socket.create_connection((parts.hostname, parts.port), 1.0).close()


def _reconnects(address: str) -> None:
    """Open the page and close it at once."""
    connect(f"ws{address[4:]}scene", proxy=None).close()


def _foxglove(address: str, **options: int) -> ClientConnection:
    limits = {"max_size": None, "proxy": None, **options}
    return connect(f"ws{address[4:]}", subprotocols=[_FOXGLOVE], **limits)  # type: ignore[arg-type]


def _subscribe(client: ClientConnection, advertisement: str) -> None:
    channels = [channel["id"] for channel in json.loads(advertisement)["channels"]]
    rows = [{"id": number, "channelId": number} for number in channels]
    client.send(json.dumps({"op": "subscribe", "subscriptions": rows}))


CLIENTS: dict[Callable[[str], None], int] = {
    _page: 2,
    _subscriber: 3,
    _stuck: 3,
    _pings: 1,
    _storm: 1,
    _reconnects: 1,
}
"""What they do, and how many do it."""


def main() -> None:
    """Start all, and wait for the end."""
    (address,) = sys.argv[1:]

    def again(work: Callable[[str], None]) -> None:
        while True:
            with contextlib.suppress(OSError, WebSocketException, TimeoutError, EOFError):
                work(address)
            time.sleep(_PAUSE)

    for work, count in CLIENTS.items():
        for _ in range(count):
            threading.Thread(target=again, args=(work,), daemon=True).start()
    with contextlib.suppress(KeyboardInterrupt):
        signal.pause()


if __name__ == "__main__":
    main()
