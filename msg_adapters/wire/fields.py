"""Where the fields of a message are among its bytes, found by asking the serializer.

A message is serialized once with marks in the fields that will vary; where the marks are is where
the fields are. So no layout is written down here, only that fields come in the order of their
definition, that numbers are in this machine's byte order, and that bytes which no mark reaches
stay the same.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from builtin_interfaces.msg import Time
import numpy as np
from numpy.typing import NDArray

__all__ = [
    "MARKED_TIME",
    "Patchable",
    "Serializer",
    "as_bytes",
    "find_count",
    "find_once",
    "marked_numbers",
    "marked_stamps",
    "runs",
]

Serializer = Callable[[Any], bytes]
"""Turns a message into its bytes on the wire."""

_MARK = bytes(range(0xA1, 0xA9))
"""Bytes of a marked stamp: as long as no stretch of padding is, and different, so that remains of
another mark beside them don't make it seem to be elsewhere."""

MARKED_TIME = Time(
    sec=int(np.frombuffer(_MARK, np.int32)[0]), nanosec=int(np.frombuffer(_MARK, np.uint32)[1])
)
"""A stamp that no clock says."""

_LEAD = 4
"""Bytes before a message in memory, so that its numbers are aligned for numpy."""


def as_bytes(values: Any, dtype: Any) -> bytes:
    """Return numbers as they are on the wire of this machine."""
    return np.asarray(values, dtype=dtype).tobytes()


def marked_numbers(count: int) -> list[float]:
    """Return distinct numbers that nothing else in a message is likely to be."""
    return [-(1.0 + 1e-3 * i) * 1.2345678901234567e-250 for i in range(count)]


def find_once(data: bytes, pattern: bytes) -> int:
    """Return the place of a pattern; it must be there once."""
    first = data.find(pattern)
    assert first >= 0, "a mark is not in the serialized message"
    assert data.find(pattern, first + 1) < 0, "a mark is in the serialized message twice"
    return first


def runs(mask: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return the (begin, end) of each run of true values."""
    edges = np.flatnonzero(np.diff(mask.astype(np.int8), prepend=0, append=0))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def find_count(one: bytes, two: bytes, count: int = 1) -> int:
    """Return the place of a sequence's length.

    Given are the bytes before ``count`` elements, and before twice as many.
    """
    words = [np.frombuffer(data[: len(data) // 4 * 4], np.uint32) for data in (one, two)]
    found = np.flatnonzero((words[0] == count) & (words[1] == 2 * count))
    assert len(found) == 1, "the length of a sequence is not to be found"
    return int(found[0]) * 4


def marked_stamps(data: bytes) -> list[int]:
    """Return the places of all stamps that are MARKED_TIME."""
    places, place = [], data.find(_MARK)
    while place >= 0:
        places.append(place)
        place = data.find(_MARK, place + len(_MARK))
    return places


class Patchable:
    """The bytes of a message, some of which are written over.

    ``stamps`` are places of stamps, ``places`` those where ``width`` numbers each begin.
    """

    def __init__(
        self,
        data: bytes,
        stamps: Sequence[int],
        places: Sequence[int] | NDArray[np.int64],
        width: int,
    ) -> None:
        # With the four bytes before the first field, fields of 8 bytes are at multiples of 8.
        self._size = len(data)
        memory = np.zeros((len(data) + 2 * _LEAD) // 8 + 1, dtype=np.float64)
        self._bytes = memory.view(np.uint8)[_LEAD : _LEAD + len(data)]
        self._bytes[:] = np.frombuffer(data, np.uint8)
        self._doubles, self._words = memory, memory.view(np.uint32)
        self._stamps = (np.array(stamps, dtype=np.int64) + _LEAD) // 4
        starts = np.array(places, dtype=np.int64) + _LEAD
        assert not np.any(starts % 8), "numbers are not where they can be written at once"
        self._numbers = starts[:, np.newaxis] // 8 + np.arange(width)

    def put_stamp(self, stamp_ns: int) -> None:
        """Write the same stamp to all places of stamps."""
        seconds, nanoseconds = divmod(int(stamp_ns), 10**9)
        self._words[self._stamps] = seconds & 0xFFFFFFFF
        self._words[self._stamps + 1] = nanoseconds

    def put_numbers(self, numbers: NDArray[np.float64]) -> None:
        """Write ``(n, width)`` numbers, row i to place i."""
        self._doubles[self._numbers] = numbers

    def put_bytes(self, place: int, data: bytes) -> None:
        """Write bytes to a place."""
        self._bytes[place : place + len(data)] = np.frombuffer(data, np.uint8)

    def data(self) -> bytes:
        """Return the bytes as they are now."""
        return self._bytes.tobytes()
