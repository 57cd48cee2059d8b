"""Images as bytes: the bytes around the pixels stay, the stamp is written over.

An image is megabytes in one field of a message. To make the message and to serialize it copies
them twice; here they are copied once, to where they are sent from.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from msg_adapters.wire.fields import (
    as_bytes,
    find_count,
    find_once,
    marked_stamps,
    MARKED_TIME,
    Serializer,
)

__all__ = ["BulkWire"]

_MARK = bytes(range(0xC1, 0xC9))
"""Of a sequence of bytes."""


class BulkWire:
    """The bytes of a message with a header and a field ``data`` of bytes, e.g. an image."""

    def __init__(self, serialize: Serializer, message: Any, frame_id: str) -> None:
        """Take all of ``message`` but its stamp and its data, which are written over in it."""
        message.header.frame_id = frame_id
        message.header.stamp = MARKED_TIME
        one, two = (self._marked(serialize, message, count) for count in (1, 2))
        place = find_once(one, _MARK)
        self._before, self._behind = one[:place], one[place + len(_MARK) :]
        self._count = find_count(one[:place], two[:place], len(_MARK))
        (self._stamp,) = marked_stamps(self._before)

    @staticmethod
    def _marked(serialize: Serializer, message: Any, count: int) -> bytes:
        message.data = list(count * _MARK)
        return bytes(serialize(message))

    def data(self, stamp_ns: int, pixels: NDArray[Any]) -> bytes:
        """Return the message with these pixels, an array of any type without gaps."""
        before = bytearray(self._before)
        stamp = as_bytes(divmod(int(stamp_ns), 10**9), np.int32)
        before[self._stamp : self._stamp + len(stamp)] = stamp
        before[self._count : self._count + 4] = as_bytes(pixels.nbytes, np.uint32)
        return b"".join((before, pixels.data, self._behind))
