"""Triangles as bytes: TRIANGLE_LIST markers whose corners and colours change at each update.

The corners of a marker are objects of a message, tens of thousands of them where a surface is
shown; here they are one array that goes between the bytes around them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from copy import copy
from typing import NamedTuple

from geometry_msgs.msg import Point
import numpy as np
from numpy.typing import NDArray
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from msg_adapters.wire.fields import as_bytes, Serializer
from msg_adapters.wire.layout import layout
from msg_adapters.wire.marker_fill import (
    ALIGNMENT,
    COUNT,
    FIRST,
    gap_behind,
    marker_before,
    MARKER_STAMPS,
)

__all__ = ["Appendix", "TriangleListWire", "append_markers"]

FloatArray = NDArray[np.float64]
ColorArray = NDArray[np.float32]


class _Piece(NamedTuple):
    """The bytes before the corners, between them and the colours, and behind; places of stamps."""

    parts: tuple[bytes, ...]
    counts: tuple[int, ...]
    """Where the number of corners, and of colours, is in the part before them."""
    stamps: tuple[int, ...]
    """Places in the first part."""


class TriangleListWire:
    """The bytes of a marker, from where it begins; or of a whole array with it as the last."""

    def __init__(
        self, serialize: Serializer, marker: Marker, *, has_colors: bool, is_whole: bool = False
    ) -> None:
        """Take all of ``marker`` but its stamp, corners and colours.

        ``has_colors``: each corner has one. ``is_whole``: it is an array by itself.
        """
        self._serialize = serialize
        self._marker = marker
        self._has_colors, self._is_whole = has_colors, is_whole
        self._pieces: dict[int, _Piece] = {}

    def data(
        self,
        corners: FloatArray,
        stamp_ns: int,
        *,
        colors: ColorArray | None = None,
        before: Sequence[Marker] = (),
        key: int = 0,
    ) -> bytes:
        """Return the marker with ``corners`` (3 t, 3), t > 0, and ``colors`` (3 t, 4) or None.

        ``before`` are markers that stand before it in the array; they are the same for the same
        ``key``.
        """
        piece = self._pieces.get(key)
        if piece is None:
            piece = self._pieces[key] = self._probe(before)
        values = [np.ascontiguousarray(corners, dtype=np.float64)]
        if self._has_colors:
            assert colors is not None
            values.append(np.ascontiguousarray(colors, dtype=np.float32))
        parts = [bytearray(part) for part in piece.parts]
        stamp = as_bytes(divmod(int(stamp_ns), 10**9), np.int32)
        for place in piece.stamps:
            parts[0][place : place + len(stamp)] = stamp
        joined: list[bytes | bytearray] = []
        for part, place, rows in zip(parts, piece.counts, values, strict=False):
            part[place : place + 4] = as_bytes(len(rows), np.uint32)
            joined += (part, rows.tobytes())
        return b"".join([*joined, parts[-1]])

    def _probe(self, before: Sequence[Marker]) -> _Piece:
        """Find the bytes around the corners, and around the colours, of a marker with one."""
        marker = copy(self._marker)
        marker.points, marker.colors = [Point()], [ColorRGBA()] * self._has_colors
        message = MarkerArray(markers=[*before, marker])
        fields, data = layout(message), self._serialize(message)
        stamps = fields.begins(MARKER_STAMPS)
        begin = 0 if self._is_whole else stamps[-1]
        parts, counts, position = [], [], begin
        sequences = (("points", "x"), ("colors", "r"))[: 1 + self._has_colors]
        for name, first in sequences:
            start = fields.begins(f"markers.{name}.{first}")[-1]
            counts.append(fields.begins(f"markers.{name}[]")[-1] - position)
            parts.append(data[position:start])
            position = fields.within(f"markers.{name}")[-1].end
        inner = tuple(stamp - begin for stamp in stamps if stamp >= begin)
        return _Piece((*parts, data[position:]), tuple(counts), inner)


Appendix = Callable[[Sequence[Marker], int], bytes]
"""Returns the bytes of a marker behind others; the second argument says which these are."""


def append_markers(data: bytes, appendices: Iterable[Appendix]) -> bytes:
    """Return a serialized MarkerArray with more markers behind those that are in it."""
    count = int(np.frombuffer(data, np.uint32, 1, COUNT)[0])
    parts = [data if count else data[:FIRST]]
    position = len(parts[0])
    for appendix in appendices:
        space = gap_behind(position) if count else 0
        position += space
        alignment = position % ALIGNMENT
        piece = appendix([marker_before(alignment)], alignment)
        parts += (bytes(space), piece)
        position += len(piece)
        count += 1
    result = bytearray(b"".join(parts))
    result[COUNT : COUNT + 4] = as_bytes(count, np.uint32)
    return bytes(result)
