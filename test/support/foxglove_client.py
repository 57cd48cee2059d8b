"""A client of Foxglove's protocol, written from its specification alone.

It reads messages by the definitions that the server sends, with the package `rosbags`: nothing of
ROS or of this project is asked what is in them.
"""

from __future__ import annotations

from collections.abc import Callable
import contextlib
import json
import struct
from typing import Any

from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Subprotocol

__all__ = ["FoxgloveClient"]

DEADLINE = 60.0
"""Seconds after which a test gives up waiting: far more than anything takes on a busy machine."""


class FoxgloveClient:
    """What a client knows after the messages that it took."""

    def __init__(
        self, address: str, *, name: str = "foxglove.websocket.v1", query: str = "", **options: Any
    ) -> None:
        """Connect to ``http://host:port/`` by a name of the protocol."""
        self._connected = contextlib.ExitStack()
        limits = {"max_size": None, "max_queue": None, "open_timeout": DEADLINE, "proxy": None}
        self.socket: ClientConnection = self._connected.enter_context(
            connect(
                f"ws{address.removeprefix('http')}{query}",
                subprotocols=[Subprotocol(name)],
                **{**limits, **options},
            )
        )
        self.info: dict[str, Any] = {}
        self.channels: dict[int, dict[str, Any]] = {}
        self.errors: list[str] = []
        self.times: list[int] = []
        self.assets: dict[int, bytes | str] = {}
        """Answers to requests for files by their numbers: what was sent, or why nothing was."""
        self.messages: dict[int, list[tuple[int, bytes]]] = {}
        """Times and bytes of messages by subscription."""

    def say(self, operation: str, **fields: Any) -> None:
        """Send a message."""
        self.socket.send(json.dumps({"op": operation, **fields}))

    def fetch(self, request: int, uri: str) -> bytes | str:
        """Ask for a file, and return what it holds, or why it is not sent."""
        self.say("fetchAsset", uri=uri, requestId=request)
        return self.take_until(lambda: self.assets.get(request))

    def channel(self, topic: str) -> dict[str, Any] | None:
        """Return the channel of a topic, None where it is not offered."""
        found = [each for each in self.channels.values() if each["topic"] == topic]
        assert len(found) <= 1
        return found[0] if found else None

    def subscribe(self, topic: str, subscription: int) -> None:
        """Wait for the channel of a topic, and subscribe to it."""
        channel = self.take_until(lambda: self.channel(topic))
        self.messages.setdefault(subscription, [])
        rows = [{"id": subscription, "channelId": channel["id"]}]
        self.say("subscribe", subscriptions=rows)

    def take(self, timeout: float = DEADLINE) -> None:
        """Wait for the next message and take it."""
        message = self.socket.recv(timeout=timeout)
        if isinstance(message, bytes):
            self._take_bytes(message)
            return
        content = json.loads(message)
        operation = content.pop("op")
        if operation == "serverInfo":
            assert not self.info
            self.info = content
        elif operation == "advertise":
            assert self.info, "serverInfo comes first"
            for channel in content["channels"]:
                assert channel["id"] not in self.channels
                self.channels[channel["id"]] = channel
        elif operation == "unadvertise":
            for number in content["channelIds"]:
                del self.channels[number]
        else:
            assert operation == "status", operation
            assert content["level"] == 2
            self.errors.append(content["message"])

    def _take_bytes(self, message: bytes) -> None:
        if message[0] == 2:
            assert "time" in self.info["capabilities"]
            self.times.append(struct.unpack("<Q", message[1:])[0])
            return
        if message[0] == 4:
            assert "assets" in self.info["capabilities"]
            request, status, length = struct.unpack_from("<IBI", message, 1)
            said, data = message[10 : 10 + length].decode(), message[10 + length :]
            assert (status == 0) == (not said)
            self.assets[request] = said if status else data
            return
        assert message[0] == 1
        subscription, time = struct.unpack_from("<IQ", message, 1)
        self.messages[subscription].append((time, message[13:]))

    def take_until(self, condition: Callable[[], Any]) -> Any:
        """Take messages until a condition holds, and return what it is."""
        while not (result := condition()):
            self.take()
        return result

    def take_message(self, subscription: int, condition: Callable[[Any], Any], topic: str) -> Any:
        """Take messages until one of a subscription is as wanted, and return it, read."""
        while True:
            while self.messages[subscription]:
                message = self.read(topic, self.messages[subscription].pop(0)[1])
                if condition(message):
                    return message
            self.take()

    def read(self, topic: str, data: bytes) -> Any:
        """Return a message of a topic, read by the definition that came with its channel."""
        from rosbags.typesys import get_types_from_msg, get_typestore, Stores

        channel = self.channel(topic)
        assert channel is not None
        assert (channel["encoding"], channel["schemaEncoding"]) == ("cdr", "ros2msg")
        types = get_typestore(Stores.EMPTY)
        types.register(get_types_from_msg(channel["schema"], channel["schemaName"]))
        return types.deserialize_cdr(data, channel["schemaName"])

    def wait_closed(self) -> tuple[int | None, str]:
        """Take messages until the other side ends the connection; return its code and reason."""
        try:
            while True:
                self.take()
        except ConnectionClosed as closed:
            received = closed.rcvd
            return (None, "") if received is None else (received.code, received.reason)

    def close(self) -> None:
        """Leave."""
        with contextlib.suppress(ConnectionClosed):
            self._connected.close()
