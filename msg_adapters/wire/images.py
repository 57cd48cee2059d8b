"""Images as bytes: the bytes around the pixels stay, the stamp is written over.

An image is megabytes in one field of a message. To make the message and to serialize it copies
them twice; here they are copied once, to where they are sent from.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from msg_adapters.wire.fields import as_bytes, Serializer
from msg_adapters.wire.layout import layout

__all__ = ["BulkWire"]


class BulkWire:
    """The bytes of a message with a header and a field ``data`` of bytes, e.g. an image."""

    def __init__(self, serialize: Serializer, message: Any, frame_id: str) -> None:
        """Take all of ``message`` but its stamp and its data, which are written over in it."""
        message.header.frame_id, message.data = frame_id, []
        fields, data = layout(message), bytes(serialize(message))
        place = fields.begin("data")
        self._before, self._behind = data[:place], data[place:]
        self._count, self._stamp = fields.begin("data[]"), fields.begin("header.stamp.sec")

    def data(self, stamp_ns: int, pixels: NDArray[Any]) -> bytes:
        """Return the message with these pixels, an array of any type without gaps."""
        before = bytearray(self._before)
        stamp = as_bytes(divmod(int(stamp_ns), 10**9), np.int32)
        before[self._stamp : self._stamp + len(stamp)] = stamp
        before[self._count : self._count + 4] = as_bytes(pixels.nbytes, np.uint32)
        return b"".join((before, pixels.data, self._behind))
