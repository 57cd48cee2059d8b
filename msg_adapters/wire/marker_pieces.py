"""Markers in bytes, one by one and in a row: the pieces of a message of many of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray
from visualization_msgs.msg import Marker

from msg_adapters.plain_look import PlainLook
from msg_adapters.wire.marker_fill import ALIGNMENT, gap_behind
from msg_adapters.wire.plain_markers import Piece, PlainPieces

__all__ = ["Look", "PieceRow", "Pieces", "TriangleLook"]


class TriangleLook(NamedTuple):
    """A marker without its corners, and these (3 t, 3), in metres."""

    marker: Marker
    corners: NDArray[np.float64]


Look: TypeAlias = PlainLook | TriangleLook | Marker
"""A marker without its pose and stamp."""


class Pieces:
    """The pieces of some markers, those of the plain ones made all at once when one is needed."""

    def __init__(
        self,
        markers: Sequence[Look],
        plain: PlainPieces,
        make: Callable[[Marker | TriangleLook, int], Piece],
    ) -> None:
        self.markers = markers
        self._plain, self._make = plain, make
        self._made: dict[int, list[Piece | None]] = {}

    def carried_over(self, markers: Sequence[Look], before: Sequence[int]) -> Pieces:
        """Return the pieces of other markers, of which some were at these rows before."""
        result = Pieces(markers, self._plain, self._make)
        for alignment, made in list(self._made.items()):
            result._made[alignment] = [made[row] if row >= 0 else None for row in before]
        return result

    def get(self, index: int, alignment: int) -> Piece:
        """Return a piece that begins at a position with this alignment."""
        made = self._made.get(alignment)
        if made is None:
            made = self._made[alignment] = [None] * len(self.markers)
        piece = made[index]
        if piece is None:
            marker = self.markers[index]
            if isinstance(marker, PlainLook):
                return self._make_plain(made, index, alignment)
            piece = made[index] = self._make(marker, alignment)
        return piece

    def _make_plain(self, made: list[Piece | None], index: int, alignment: int) -> Piece:
        """Make the pieces of all plain markers; return one of them."""
        looks = {
            i: marker
            for i, marker in enumerate(self.markers)
            if made[i] is None and isinstance(marker, PlainLook)
        }
        pieces = dict(zip(looks, self._plain.make(list(looks.values()), alignment), strict=True))
        for i, piece in pieces.items():
            made[i] = piece
        return pieces[index]


class PieceRow:
    """Pieces one behind the other, and where their stamps and poses are."""

    def __init__(self, data: bytes, count: int) -> None:
        """Begin with an array of ``count`` markers, or with the bytes before the first."""
        self._parts = [data]
        self._position = len(data)
        self._has_some = count > 0
        self.stamps: list[int] = []
        self.poses: list[int] = []

    def alignment(self) -> int:
        """Return the beginning of the next piece, modulo ALIGNMENT."""
        position = self._position
        return (position + gap_behind(position) * self._has_some) % ALIGNMENT

    def put(self, piece: Piece) -> None:
        """Put a piece, made for that alignment, behind the others."""
        position = self._position
        if self._has_some:
            gap = gap_behind(position)
            self._parts.append(bytes(gap))
            position += gap
        self._parts.append(piece.data)
        self.stamps.append(position + piece.stamp)
        self.poses.append(position + piece.pose)
        self._position, self._has_some = position + len(piece.data), True

    def data(self) -> bytes:
        """Return all bytes."""
        return b"".join(self._parts)
