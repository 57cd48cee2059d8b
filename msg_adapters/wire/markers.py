"""Markers as bytes: pieces from the serializer, in a row, with poses put in by numpy.

A marker becomes a piece once, in each position relative to the alignment of its fields in which
it is needed; a message is such pieces in a row. While the same markers move, nothing is joined:
poses and stamps are written over those of the last message.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from visualization_msgs.msg import Marker, MarkerArray

from msg_adapters.marker_rows import marker_id, MarkerRows
from msg_adapters.markers import marker_and_triangles, plain_look
from msg_adapters.plain_look import PlainLook
from msg_adapters.wire.fields import as_bytes, Patchable, Serializer
from msg_adapters.wire.layout import layout
from msg_adapters.wire.marker_fill import COUNT, FIRST, marker_before
from msg_adapters.wire.marker_pieces import Look, PieceRow, Pieces, TriangleLook
from msg_adapters.wire.plain_markers import Piece, PlainPieces
from scene_graph_ros.geometry.spatial.poses import quaternions_from_poses
from scene_graph_ros.geometry.steps import between_steps
from scene_graph_ros.views.draw_list import DrawItem, DrawList

__all__ = ["MarkerWire", "PreparedMarkers"]

_WIDTH = 7
"""Of a pose: position and quaternion."""

_ROWS_IN_A_STEP = 256
"""Pieces that are joined at a stretch: half a millisecond."""

_TEMPLATES_KEPT = 2
"""Joined messages remembered: usually all markers, and those that move."""


class PreparedMarkers(NamedTuple):
    """The markers of one version of a scene, ready to be taken."""

    items: DrawList
    pieces: Pieces
    templates: dict[bytes, Patchable]
    """Messages of all, and of those that are likely to be sent next, by their rows."""
    base: DrawList
    """The markers that were prepared before, and below the row that each has among them."""
    rows_before: list[int]

    def rows_in(self, before: DrawList) -> list[int]:
        """Return the row that each of these has in the list before, -1 for none."""
        return self.rows_before if before is self.base else before.rows_of(self.items.items)


class _Sent(NamedTuple):
    """The messages that were sent last, by rows of the markers that they show."""

    items: DrawList
    templates: dict[bytes, Patchable]


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
        self._head = self._array([Marker()])[:FIRST]
        """What is before the first marker."""
        self._plain = PlainPieces(self._array, frame_id)
        self._rows = MarkerRows()
        self._pieces = Pieces([], self._plain, self._make_piece)
        self._sent = _Sent(self._rows.listed, {})
        empty = DrawList([])
        self._prepared = PreparedMarkers(empty, self._pieces, {}, empty, [])

    def set_items(self, items: Iterable[DrawItem]) -> None:
        """Take over which geometries there are; see ``SceneMarkers.set_items``."""
        self.take(self.prepare(items))

    def prepare(self, items: Iterable[DrawItem]) -> PreparedMarkers:
        """Return the markers of a scene in bytes, in their order, to be taken.

        Pieces in common with those that were prepared before are not made again. Any
        thread may call this while another sends messages. Raises MeshError or InvalidShapeError
        where a mesh can't be read, ValueError where two markers have the same namespace and id.
        """
        listed, known = DrawList(items), self._prepared
        before = known.items.rows_of(listed.items)
        markers = [
            self._look(item) if row < 0 else known.pieces.markers[row]
            for item, row in zip(listed.items, before, strict=True)
        ]
        pieces = known.pieces.carried_over(markers, before)
        templates = {}
        for rows in self._likely_rows(known.items, np.array(before, dtype=np.int64)):
            key = _key(rows)
            if key not in templates:
                templates[key] = self._join(rows.tolist(), pieces)
        self._prepared = PreparedMarkers(listed, pieces, templates, known.items, before)
        return self._prepared

    def _likely_rows(self, known: DrawList, before: NDArray[np.int64]) -> list[NDArray[np.int64]]:
        """Return the likely rows of messages: all, the new ones, and those that move.

        Those that move were sent last; ``before`` has the rows among the markers before.
        """
        new = before < 0
        result = [np.arange(len(before)), np.flatnonzero(new)]
        # Read at once: what is shown may be taken over at any moment.
        listed, templates = self._sent
        if listed is known:
            for key in list(templates):
                was_sent = np.zeros(len(known.items), dtype=bool)
                was_sent[np.frombuffer(key, dtype=np.int64)] = True
                moves = np.zeros(len(before), dtype=bool)
                moves[~new] = was_sent[before[~new]]
                result += [np.flatnonzero(moves | new), np.flatnonzero(moves)]
        return [rows for rows in result if len(rows)]

    def take(self, prepared: PreparedMarkers) -> None:
        """Show these markers from now on."""
        self._rows.take(prepared.items, prepared.rows_in)
        self._pieces = prepared.pieces
        self._sent = _Sent(prepared.items, dict(prepared.templates))

    def _look(self, item: DrawItem) -> Look:
        plain = plain_look(item)
        if plain is not None:
            return plain
        marker, triangles = marker_and_triangles(
            item, frame_id=self._frame_id, package_shares=self._package_shares
        )
        if triangles is None:
            return marker
        corners = triangles.vertices[triangles.triangles.ravel()]
        return TriangleLook(marker, corners) if len(corners) else marker

    def message(
        self,
        X_WG: NDArray[np.float64],
        stamp_ns: int,
        *,
        is_whole: bool,
        starts_over: bool = False,
    ) -> tuple[bytes, int]:
        """Return deletions of vanished items and markers at ``X_WG``; and how many in all.

        Markers of all items where ``is_whole``, else of those that moved. Where it ``starts_over``
        everything that a viewer may show is deleted first.
        """
        rows = np.arange(len(X_WG)) if is_whole else self._rows.moved(X_WG)
        deleted = [
            _deletion(group, marker_id(identity), Marker.DELETE)
            for group, identity in self._rows.take_vanished()
        ]
        X_WM = self._rows.place(rows, X_WG)
        template = self._starting_over(rows) if starts_over else self._template(rows)
        template.put_stamp(stamp_ns)
        if len(rows):
            numbers = np.empty((len(rows), _WIDTH))
            numbers[:, :3], numbers[:, 3:] = X_WM[:, :3, 3], quaternions_from_poses(X_WM)
            template.put_numbers(numbers)
        data, count = template.data(), len(rows) + starts_over
        if starts_over or not deleted:
            return data, count
        return self._with_deletions(data, count, deleted, stamp_ns), count + len(deleted)

    def _template(self, rows: NDArray[np.int64]) -> Patchable:
        key, templates = _key(rows), self._sent.templates
        template = templates.pop(key, None) or self._join(rows.tolist(), self._pieces)
        while len(templates) >= _TEMPLATES_KEPT:
            del templates[next(iter(templates))]
        # Used last is kept longest.
        templates[key] = template
        return template

    def _starting_over(self, rows: NDArray[np.int64]) -> Patchable:
        """Put some markers behind the deletion of all that a viewer may show."""
        return self._join(rows.tolist(), self._pieces, [_deletion("", 0, Marker.DELETEALL)])

    def _join(
        self, rows: Sequence[int], pieces: Pieces, first: Sequence[PlainLook] = ()
    ) -> Patchable:
        """Put the pieces of some markers in a row, behind deletions if there are."""
        if not len(rows) and not first:
            return Patchable(self._array([]), [], [], _WIDTH)
        row = PieceRow(self._head, 0)
        deletions = Pieces(first, self._plain, self._make_piece)
        for index in range(len(first)):
            row.put(deletions.get(index, row.alignment()))
        for count, index in enumerate(rows):
            if count % _ROWS_IN_A_STEP == 0:
                between_steps()
            row.put(pieces.get(index, row.alignment()))
        template = Patchable(row.data(), row.stamps, row.poses[len(first) :], _WIDTH)
        template.put_bytes(COUNT, as_bytes(len(first) + len(rows), np.uint32))
        return template

    def _with_deletions(
        self, data: bytes, count: int, deleted: list[PlainLook], stamp_ns: int
    ) -> bytes:
        """Put deletions behind the ``count`` markers that are in the bytes of an array."""
        pieces = Pieces(deleted, self._plain, self._make_piece)
        row = PieceRow(data if count else self._head, count)
        for index in range(len(deleted)):
            row.put(pieces.get(index, row.alignment()))
        whole = Patchable(row.data(), row.stamps, [], _WIDTH)
        whole.put_stamp(stamp_ns)
        whole.put_bytes(COUNT, as_bytes(count + len(deleted), np.uint32))
        return whole.data()

    def _make_piece(self, look: Marker | TriangleLook, alignment: int) -> Piece:
        before = marker_before(alignment)
        marker = look.marker if isinstance(look, TriangleLook) else look
        fields = layout(marker, alignment)
        pose = fields.begin("pose.position.x") - alignment
        if isinstance(look, TriangleLook):
            # Only where something is shown as triangles.
            from msg_adapters.wire.triangles import TriangleListWire

            wire = TriangleListWire(self._serialize, marker, has_colors=False)
            # The corners are put in as a block: as objects they take seconds.
            return Piece(wire.data(look.corners, 0, before=[before]), 0, pose)
        data = self._array([before, marker])
        return Piece(data[len(data) - (fields.size - alignment) :], 0, pose)

    def _array(self, markers: list[Marker]) -> bytes:
        return self._serialize(MarkerArray(markers=markers))


def _deletion(ns: str, identity: int, action: int) -> PlainLook:
    return PlainLook(ns, identity, 0, action, (0.0,) * 3, (0.0,) * 4)


def _key(rows: NDArray[np.int64]) -> bytes:
    return rows.tobytes()
