"""Events of a recording beside messages: the order of updates and edits, as JSON in a topic.

Each event is a ``std_msgs/String`` on `EVENTS`. With the messages between them they are all that
the world depends on, so that a replay goes through the same states.
"""

from __future__ import annotations

import base64
import json
import struct
from typing import Any

__all__ = ["EVENTS", "VERSION", "bytes_of", "decode", "encode", "text_of"]

EVENTS = "~/recording"
"""Topic of the events, below the node's name."""

VERSION = 4
"""Of the events; a replay reads its own version only."""

_HEADER = struct.Struct("<4sI")
_LITTLE_ENDIAN = b"\x00\x01\x00\x00"


def encode(event: str, **values: Any) -> bytes:
    """Return an event as a serialized ``std_msgs/String``."""
    text = json.dumps({"event": event, **values}, separators=(",", ":")).encode() + b"\0"
    return _HEADER.pack(_LITTLE_ENDIAN, len(text)) + text


def decode(data: bytes) -> dict[str, Any]:
    """Return an event. Raises ValueError for bytes that are none."""
    if len(data) < _HEADER.size or data[:4] != _LITTLE_ENDIAN:
        raise ValueError(f"{len(data)} bytes are no event of a recording")
    try:
        event = json.loads(data[_HEADER.size :].split(b"\0", 1)[0])
    except RecursionError as error:
        raise ValueError("an event is nested too deeply") from error
    if isinstance(event, dict) and isinstance(event.get("event"), str):
        return event
    raise ValueError(f"an event has no name: {str(event)[:100]}")


def text_of(data: bytes) -> str:
    """Return bytes as text for an event."""
    return base64.b64encode(data).decode()


def bytes_of(text: str) -> bytes:
    """Return the bytes that `text_of` made a text of. Raises ValueError for another text."""
    return base64.b64decode(text, validate=True)
