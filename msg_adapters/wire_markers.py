"""Markers as bytes: pieces from the serializer, in a row, with poses put in by numpy.

A marker is serialized once, in each position relative to the alignment of its fields in which it
is needed; a message is such pieces in a row. While the same markers move, nothing is joined: poses
and stamps are written over those of the last message. Where each thing is, is found by marks (see
``wire``).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import NamedTuple

from geometry_msgs.msg import Point, Pose, Quaternion
import numpy as np
from numpy.typing import NDArray
from visualization_msgs.msg import Marker, MarkerArray, MeshFile

from msg_adapters.markers import MarkerItem, SceneMarkers
from msg_adapters.wire import (
    as_bytes,
    find_count,
    find_once,
    marked_numbers,
    marked_stamps,
    MARKED_TIME,
    Patchable,
    Serializer,
)
from scene_graph_ros.geometry.spatial.poses import quaternions_from_poses

__all__ = ["MarkerWire"]

_WIDTH = 7
"""Of a pose: position and quaternion."""

_ALIGNMENT = 8
"""Bytes of the largest field, after which the layout of a message repeats."""

_TEMPLATES_KEPT = 2
"""Joined messages remembered: usually all markers, and those that move."""


class _Piece(NamedTuple):
    """A marker in bytes; ``stamp`` and ``pose`` are places in it."""

    data: bytes
    stamp: int
    pose: int


class _Fill(NamedTuple):
    """How markers follow one another, found by trying; indexed by position modulo 8."""

    first: int
    """Where the first marker begins."""
    gap: tuple[int, ...]
    """Bytes between a marker that ends at a position and the next one."""
    before: dict[int, Marker]
    """What to put before a marker, so that it begins at such a position."""
    length: int
    """Where the number of markers is."""


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
        self._scene = SceneMarkers(frame_id=frame_id, package_shares=package_shares)
        self._fill = _probe_fill(self._array)
        self._pieces: dict[tuple[int, int], _Piece] = {}
        self._templates: dict[bytes, Patchable] = {}

    def set_items(self, items: Iterable[MarkerItem]) -> None:
        """Take over which geometries there are; see ``SceneMarkers.set_items``."""
        self._scene.set_items(items)
        kept = {id(marker) for marker in self._scene.markers}
        self._pieces = {key: p for key, p in self._pieces.items() if key[0] in kept}
        self._templates.clear()

    def message(
        self, X_WG: NDArray[np.float64], stamp_ns: int, *, is_whole: bool
    ) -> tuple[bytes, int]:
        """Return deletions of what vanished and markers at ``X_WG``; and how many in all.

        Markers of all items where ``is_whole``, else of those that moved.
        """
        scene = self._scene
        rows = np.arange(len(X_WG)) if is_whole else scene.moved_rows(X_WG)
        deleted = scene.deletions(stamp_ns).markers
        X_WM = scene.place(rows, X_WG)
        template = self._template(rows, deleted)
        template.put_stamp(stamp_ns)
        if len(rows):
            numbers = np.empty((len(rows), _WIDTH))
            numbers[:, :3], numbers[:, 3:] = X_WM[:, :3, 3], quaternions_from_poses(X_WM)
            template.put_numbers(numbers)
        return template.data(), len(deleted) + len(rows)

    def _template(self, rows: NDArray[np.int64], deleted: list[Marker]) -> Patchable:
        if deleted:
            return self._join(rows, deleted)
        key = rows.tobytes()
        template = self._templates.pop(key, None) or self._join(rows, [])
        while len(self._templates) >= _TEMPLATES_KEPT:
            del self._templates[next(iter(self._templates))]
        # Used last is kept longest.
        self._templates[key] = template
        return template

    def _join(self, rows: NDArray[np.int64], deleted: list[Marker]) -> Patchable:
        """Put the pieces of deletions and markers in a row."""
        fill, chosen = self._fill, self._scene.markers
        count = len(deleted) + len(rows)
        if count == 0:
            return Patchable(self._array([]), [], [], _WIDTH)
        parts, stamps, poses = [self._head()], [], []
        position = fill.first
        gap = 0
        for index, row in enumerate((*range(-len(deleted), 0), *rows.tolist())):
            marker = deleted[index] if row < 0 else chosen[row]
            position += gap
            piece = self._piece(marker, position % _ALIGNMENT, is_kept=row >= 0)
            parts += (bytes(gap), piece.data)
            stamps.append(position + piece.stamp)
            if row >= 0:
                poses.append(position + piece.pose)
            position += len(piece.data)
            gap = fill.gap[position % _ALIGNMENT]
        template = Patchable(b"".join(parts), stamps, poses, _WIDTH)
        template.put_bytes(fill.length, as_bytes(count, np.uint32))
        return template

    def _head(self) -> bytes:
        return self._array([Marker()])[: self._fill.first]

    def _piece(self, marker: Marker, alignment: int, *, is_kept: bool) -> _Piece:
        key = id(marker), alignment
        piece = self._pieces.get(key)
        if piece is None:
            piece = self._make_piece(marker, alignment)
            if is_kept:
                self._pieces[key] = piece
        return piece

    def _make_piece(self, marker: Marker, alignment: int) -> _Piece:
        before = self._fill.before[alignment]
        given = marker.header.stamp, marker.pose
        numbers = marked_numbers(_WIDTH)
        marker.header.stamp, marker.pose = MARKED_TIME, _pose(numbers)
        data = self._array([before, marker])
        marker.header.stamp, marker.pose = given
        (begin,) = marked_stamps(data)
        pose = find_once(data, as_bytes(numbers, np.float64)) - begin
        if marker.action == Marker.DELETE:
            data = self._array([before, marker])
        return _Piece(data[begin:], 0, pose)

    def _array(self, markers: list[Marker]) -> bytes:
        return self._serialize(MarkerArray(markers=markers))


def _pose(numbers: list[float]) -> Pose:
    x, y, z, qx, qy, qz, qw = numbers
    return Pose(position=Point(x=x, y=y, z=z), orientation=Quaternion(x=qx, y=qy, z=qz, w=qw))


def _probe_fill(array: Callable[[list[Marker]], bytes]) -> _Fill:
    """Find how markers follow one another, by markers that end at every position."""
    marked = Marker()
    marked.header.stamp = MARKED_TIME
    (first,) = marked_stamps(array([marked]))
    gap, before = [-1] * _ALIGNMENT, {}
    for length in range(_ALIGNMENT):
        other = Marker(mesh_file=MeshFile(data=bytes(length)))
        end = len(array([other]))
        (begin,) = marked_stamps(array([other, marked]))
        gap[end % _ALIGNMENT] = begin - end
        before[begin % _ALIGNMENT] = other
    assert min(gap) >= 0, "not every position was tried"
    length_at = find_count(array([Marker()])[:first], array([Marker(), Marker()])[:first])
    return _Fill(first, tuple(gap), before, length_at)
