"""Foxglove's protocol for live data: its messages in both directions, as text and bytes.

Foxglove and Lichtblick speak it. Here is the part of a server that only shows: it offers channels,
and clients subscribe to them. Source: docs/spec.md of github.com/foxglove/ws-protocol; the newer
name of the protocol differs in parts that are not offered here.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
import json
import struct
from typing import Any, NamedTuple

from scene_graph_ros.geometry.quoting import quoted

__all__ = [
    "SUBPROTOCOLS",
    "ChannelInfo",
    "Request",
    "RequestError",
    "advertisement",
    "asset_error",
    "asset_head",
    "message_data",
    "parse_request",
    "server_info",
    "status_error",
    "time_data",
    "unadvertisement",
]

SUBPROTOCOLS = ("foxglove.sdk.v1", "foxglove.websocket.v1")
"""Names by which clients ask for it, the newer one first."""

_ERROR = 2
_MESSAGE_DATA = struct.Struct("<BIQ")
_TIME = struct.Struct("<BQ")
_ASSET = struct.Struct("<BIBI")

_NOT_OFFERED = frozenset(
    {
        "advertise",
        "getParameters",
        "setParameters",
        "subscribeConnectionGraph",
        "subscribeParameterUpdates",
        "unadvertise",
        "unsubscribeConnectionGraph",
        "unsubscribeParameterUpdates",
    }
)
"""What other servers may offer: a client is told that this one does not."""


class ChannelInfo(NamedTuple):
    """A channel as clients know it: its messages are in CDR, as ROS 2 has them."""

    number: int
    topic: str
    kind: str
    """``package/msg/Name``"""
    definition: str
    """The text of the message's definition, with those of the messages that it is made of."""


class RequestError(ValueError):
    """A message of a client that is none."""


class Request(NamedTuple):
    """A client's request."""

    subscribe: tuple[tuple[int, int], ...] = ()
    """Numbers that it chose for subscriptions, and of their channels."""
    unsubscribe: tuple[int, ...] = ()
    """Numbers of subscriptions."""
    asset: tuple[int, str] | None = None
    """The number of a request for a file, and its address."""
    not_offered: str = ""
    """What it asks for that this server does not do."""


def server_info(name: str, session: str, *, tells_time: bool, has_assets: bool) -> str:
    """Return the first message to a client; ``session`` differs from those of other servers."""
    return _text(
        "serverInfo",
        name=name,
        capabilities=["time"] * tells_time + ["assets"] * has_assets,
        metadata={},
        sessionId=session,
    )


def advertisement(channels: Iterable[ChannelInfo]) -> str:
    """Return the message that offers channels."""
    offered = [
        {
            "id": channel.number,
            "topic": channel.topic,
            "encoding": "cdr",
            "schemaName": channel.kind,
            "schema": channel.definition,
            "schemaEncoding": "ros2msg",
        }
        for channel in channels
    ]
    return _text("advertise", channels=offered)


def unadvertisement(numbers: Iterable[int]) -> str:
    """Return the message that takes channels back."""
    return _text("unadvertise", channelIds=sorted(numbers))


def status_error(text: str) -> str:
    """Return the message that tells a client of an error."""
    return _text("status", level=_ERROR, message=text)


def message_data(subscription: int, time: int, data: bytes) -> tuple[bytes, bytes]:
    """Return a message of a channel, for a subscription, published at ``time`` in ns.

    In two parts, of which the second is ``data``, which is not copied.
    """
    return _MESSAGE_DATA.pack(1, subscription, time), data


def time_data(time: int) -> bytes:
    """Return the message with the time, in ns."""
    return _TIME.pack(2, time)


def asset_head(request: int) -> bytes:
    """Return the beginning of the answer to a request for a file: its bytes follow."""
    return _ASSET.pack(4, request, 0, 0)


def asset_error(request: int, text: str) -> bytes:
    """Return the answer to a request for a file that is not sent."""
    said = text.encode()
    return _ASSET.pack(4, request, 1, len(said)) + said


def parse_request(text: str) -> Request:
    """Return the request in a client's message. Raises RequestError for a text that is none."""
    try:
        content = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise RequestError(f"{quoted(text)} is no JSON") from error
    operation = content.get("op") if isinstance(content, dict) else None
    if operation == "subscribe":
        rows = _list(content, "subscriptions")
        return Request(subscribe=tuple((_number(r, "id"), _number(r, "channelId")) for r in rows))
    if operation == "unsubscribe":
        numbers = _list(content, "subscriptionIds")
        return Request(unsubscribe=tuple(_number({"id": n}, "id") for n in numbers))
    if operation == "fetchAsset":
        address = content.get("uri")
        if not isinstance(address, str):
            raise RequestError(f"uri is no text: {quoted(address)}")
        return Request(asset=(_number(content, "requestId"), address))
    if isinstance(operation, str) and operation in _NOT_OFFERED:
        return Request(not_offered=operation)
    raise RequestError(f"op is no operation of the protocol: {quoted(operation)}")


def _text(operation: str, **fields: Any) -> str:
    return json.dumps({"op": operation, **fields})


def _list(content: Mapping[str, Any], field: str) -> list[Any]:
    values = content.get(field)
    if not isinstance(values, list):
        raise RequestError(f"{field} is no list: {quoted(values)}")
    return values


def _number(row: Any, field: str) -> int:
    """Return an unsigned integer of 32 bits."""
    value = row.get(field) if isinstance(row, dict) else None
    if type(value) is not int or not 0 <= value < 1 << 32:
        raise RequestError(f"{field} is no unsigned integer of 32 bits: {quoted(value)}")
    return value
