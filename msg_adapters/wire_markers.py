"""Markers as bytes: pieces from the serializer, in a row, with poses put in by numpy.

A marker becomes a piece once, in each position relative to the alignment of its fields in which
it is needed; a message is such pieces in a row. While the same markers move, nothing is joined:
poses and stamps are written over those of the last message. Where each thing is, is found by marks
(see ``wire``).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from visualization_msgs.msg import Marker, MarkerArray

from msg_adapters.marker_fill import ALIGNMENT, probe_fill
from msg_adapters.marker_rows import MarkerItem, MarkerRows
from msg_adapters.markers import marker_from_shape, plain_look
from msg_adapters.wire import (
    as_bytes,
    find_once,
    marked_numbers,
    marked_stamps,
    MARKED_TIME,
    Patchable,
    Serializer,
)
from msg_adapters.wire_plain_markers import marked_pose, Piece, PlainLook, PlainPieces
from scene_graph_ros.geometry.spatial.poses import quaternions_from_poses

__all__ = ["MarkerWire"]

_WIDTH = 7
"""Of a pose: position and quaternion."""

_TEMPLATES_KEPT = 2
"""Joined messages remembered: usually all markers, and those that move."""


class MarkerWire:
    """Serializes the markers of one role, as ``SceneMarkers`` and the serializer do."""

    def __init__(
        self,
        serialize: Serializer,
        *,
        frame_id: str,
        package_shares: Mapping[str, Path] | None = None,
    ) -> None:
        """Place markers in ``frame_id``, the world; see ``resource_uri`` for package_shares."""
        self._serialize = serialize
        self._frame_id, self._package_shares = frame_id, package_shares
        self._fill = probe_fill(self._array)
        self._plain = PlainPieces(self._array, self._fill.before, frame_id)
        self._rows = MarkerRows()
        self._pieces = _Pieces([], self._plain, self._make_piece)
        self._templates: dict[bytes, Patchable] = {}

    def set_items(self, items: Iterable[MarkerItem]) -> None:
        """Take over which geometries there are; see ``SceneMarkers.set_items``."""
        items = list(items)
        known = dict(zip(self._rows.items, self._pieces.markers, strict=True))
        markers = [known.get(item) or self._marker(item) for item in items]
        before = self._rows.set_items(items)
        self._pieces = self._pieces.carried_over(markers, before)
        self._templates.clear()

    def _marker(self, item: MarkerItem) -> PlainLook | Marker:
        return plain_look(item) or marker_from_shape(
            item, frame_id=self._frame_id, package_shares=self._package_shares
        )

    def message(
        self,
        X_WG: NDArray[np.float64],
        stamp_ns: int,
        *,
        is_whole: bool,
        starts_over: bool = False,
    ) -> tuple[bytes, int]:
        """Return deletions of what vanished and markers at ``X_WG``; and how many in all.

        Markers of all items where ``is_whole``, else of those that moved. Where it ``starts_over``
        whatever a viewer may show is deleted first.
        """
        rows = np.arange(len(X_WG)) if is_whole else self._rows.moved(X_WG)
        vanished = self._rows.take_vanished()
        if starts_over:
            deleted = [_deletion("", 0, Marker.DELETEALL)]
        else:
            deleted = [_deletion(ns, identity, Marker.DELETE) for ns, identity in vanished]
        X_WM = self._rows.place(rows, X_WG)
        template = self._template(rows, deleted)
        template.put_stamp(stamp_ns)
        if len(rows):
            numbers = np.empty((len(rows), _WIDTH))
            numbers[:, :3], numbers[:, 3:] = X_WM[:, :3, 3], quaternions_from_poses(X_WM)
            template.put_numbers(numbers)
        return template.data(), len(deleted) + len(rows)

    def _template(self, rows: NDArray[np.int64], deleted: list[PlainLook]) -> Patchable:
        if deleted:
            return self._join(rows, deleted)
        key = rows.tobytes()
        template = self._templates.pop(key, None) or self._join(rows, [])
        while len(self._templates) >= _TEMPLATES_KEPT:
            del self._templates[next(iter(self._templates))]
        # Used last is kept longest.
        self._templates[key] = template
        return template

    def _join(self, rows: NDArray[np.int64], deleted: list[PlainLook]) -> Patchable:
        """Put the pieces of deletions and markers in a row."""
        fill, chosen = self._fill, self._pieces
        deletions = _Pieces(deleted, self._plain, self._make_piece)
        count = len(deleted) + len(rows)
        if count == 0:
            return Patchable(self._array([]), [], [], _WIDTH)
        parts, stamps, poses = [self._head()], [], []
        position = fill.first
        gap = 0
        for index, row in enumerate((*range(-len(deleted), 0), *rows.tolist())):
            position += gap
            if row < 0:
                piece = deletions.get(index, position % ALIGNMENT)
            else:
                piece = chosen.get(row, position % ALIGNMENT)
                poses.append(position + piece.pose)
            parts += (bytes(gap), piece.data)
            stamps.append(position + piece.stamp)
            position += len(piece.data)
            gap = fill.gap[position % ALIGNMENT]
        template = Patchable(b"".join(parts), stamps, poses, _WIDTH)
        template.put_bytes(fill.length, as_bytes(count, np.uint32))
        return template

    def _head(self) -> bytes:
        return self._array([Marker()])[: self._fill.first]

    def _make_piece(self, look: PlainLook | Marker, alignment: int) -> Piece:
        before = self._fill.before[alignment]
        marker = look.marker(self._frame_id) if isinstance(look, PlainLook) else look
        given = marker.header.stamp, marker.pose
        numbers = marked_numbers(_WIDTH)
        marker.header.stamp, marker.pose = MARKED_TIME, marked_pose(numbers)
        data = self._array([before, marker])
        (begin,) = marked_stamps(data)
        pose = find_once(data, as_bytes(numbers, np.float64)) - begin
        marker.header.stamp, marker.pose = given
        if marker.action != Marker.ADD:
            data = self._array([before, marker])
        return Piece(data[begin:], 0, pose)

    def _array(self, markers: list[Marker]) -> bytes:
        return self._serialize(MarkerArray(markers=markers))


def _deletion(ns: str, identity: int, action: int) -> PlainLook:
    return PlainLook(ns, identity, 0, action, (0.0,) * 3, (0.0,) * 4)


class _Pieces:
    """The pieces of some markers, those of the plain ones made all at once when one is needed."""

    def __init__(
        self,
        markers: Sequence[PlainLook | Marker],
        plain: PlainPieces,
        make: Callable[[PlainLook | Marker, int], Piece],
    ) -> None:
        self.markers = markers
        self._plain, self._make = plain, make
        self._made: dict[int, list[Piece | None]] = {}

    def carried_over(
        self, markers: Sequence[PlainLook | Marker], before: Sequence[int]
    ) -> _Pieces:
        """Return the pieces of other markers, of which some were at these rows before."""
        result = _Pieces(markers, self._plain, self._make)
        for alignment, made in self._made.items():
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
                self._make_plain(made, alignment)
            piece = made[index] = made[index] or self._make(marker, alignment)
        return piece

    def _make_plain(self, made: list[Piece | None], alignment: int) -> None:
        looks = {
            i: marker
            for i, marker in enumerate(self.markers)
            if made[i] is None and isinstance(marker, PlainLook)
        }
        for i, piece in zip(looks, self._plain.make(list(looks.values()), alignment), strict=True):
            made[i] = piece
