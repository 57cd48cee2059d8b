"""Where the fields of a message are among its bytes, found by asking the serializer.

A message is serialized once with marks in the fields that will vary; where the marks are is where
the fields are. So no layout is written down here, only that fields come in the order of their
definition, that numbers are in this machine's byte order, and that bytes which no mark reaches
stay the same.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from builtin_interfaces.msg import Time
import numpy as np
from numpy.typing import NDArray

__all__ = [
    "MARKED_BYTE",
    "MARKED_TIME",
    "OTHER_BYTE",
    "OTHER_TIME",
    "Serializer",
    "as_bytes",
    "find_once",
    "marked_numbers",
    "put_stamp",
    "runs",
]

Serializer = Callable[[Any], bytes]
"""Turns a message into its bytes on the wire."""

MARKED_BYTE, OTHER_BYTE = 0xA5, 0x5A
"""Every byte of a marked stamp, and of another one."""


def _time(byte: int) -> Time:
    word = int.from_bytes(bytes([byte] * 4), "little")
    return Time(sec=word - 2**32 if word >= 2**31 else word, nanosec=word)


MARKED_TIME, OTHER_TIME = _time(MARKED_BYTE), _time(OTHER_BYTE)
"""Stamps that no clock says."""


def as_bytes(values: Any, dtype: Any) -> bytes:
    """Return numbers as they are on the wire of this machine."""
    return np.asarray(values, dtype=dtype).tobytes()


def marked_numbers(count: int) -> list[float]:
    """Return distinct numbers that nothing else in a message is likely to be."""
    return [-(1.0 + 1e-3 * i) * 1.2345678901234567e-250 for i in range(count)]


def find_once(data: bytes, pattern: bytes) -> int:
    """Return where a pattern is; it must be there once."""
    first = data.find(pattern)
    assert first >= 0, "a mark is not in the serialized message"
    assert data.find(pattern, first + 1) < 0, "a mark is in the serialized message twice"
    return first


def runs(mask: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return the (begin, end) of each run of true values."""
    edges = np.flatnonzero(np.diff(mask.astype(np.int8), prepend=0, append=0))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def put_stamp(words: NDArray[np.uint32], places: NDArray[np.int64], stamp_ns: int) -> None:
    """Write a stamp into 4-byte words; ``places`` are those of the seconds."""
    seconds, nanoseconds = divmod(int(stamp_ns), 10**9)
    words[places] = seconds & 0xFFFFFFFF
    words[places + 1] = nanoseconds
