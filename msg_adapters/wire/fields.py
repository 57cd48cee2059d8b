"""The bytes of a message, of which some are written over at each update."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["Patchable", "Serializer", "as_bytes"]

Serializer = Callable[[Any], bytes]
"""Turns a message into its bytes on the wire."""

_LEAD = 4
"""Bytes before a message in memory, so that its numbers are aligned for numpy."""


def as_bytes(values: Any, dtype: Any) -> bytes:
    """Return numbers as they are on the wire of this machine."""
    return np.asarray(values, dtype=dtype).tobytes()


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
