"""Contacts and their markers as bytes: templates from the serializer, numbers put in by numpy.

Names of geometries are serialized once and joined for the pairs that touch; stamps and
coordinates, which vary at each update, are written over. Where the pairs are the same as last
time, nothing is joined either.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray
from std_msgs.msg import Header
from visualization_msgs.msg import MarkerArray

from msg_adapters.contact_rows import KINDS, NO_ROWS, PairRows, point_rows
from msg_adapters.contacts import contact_markers_to_msg, contact_points
from msg_adapters.names import SceneNames
from msg_adapters.wire.fields import as_bytes, Patchable, Serializer
from msg_adapters.wire.layout import layout
from msg_adapters.wire.marker_fill import MARKER_STAMPS
from scene_graph_msgs.msg import ContactArray, GeometryName

__all__ = ["ContactMarkerWire", "ContactWire"]

_POINT = 24
"""Bytes: three coordinates."""

_Texts: TypeAlias = dict[int, tuple[GeometryName, bytes]]
"""Names of geometries by id, as messages and as bytes."""

_NOTHING_READY: tuple[None, _Texts] = (None, {})


class _Frame(NamedTuple):
    """The bytes around the contacts in an array of them, of kinds that are all there."""

    parts: tuple[bytes, ...]
    """What is before the contacts of the first kind, between kinds, and behind the last."""
    counts: tuple[int, ...]
    """Where the number of contacts of a kind is, in the part before them."""
    stamp: int


class ContactWire:
    """Serializes all contacts of a scene, as ``contacts_to_msg`` and the serializer do."""

    def __init__(self, frame_id: str, serialize: Serializer) -> None:
        self._frame_id = frame_id
        self._serialize = serialize
        self._frames: dict[tuple[int, ...], _Frame] = {}
        self._version = layout(self._array({})).begin("scene_version")
        self._names_of: SceneNames | None = None
        self._names: _Texts = {}
        self._ready: tuple[SceneNames | None, _Texts] = _NOTHING_READY
        self._pairs: tuple[bytes, ...] = ()
        self._template: Patchable | None = None

    def message(
        self,
        table: Any,
        names: SceneNames,
        *,
        stamp_ns: int,
        scene_version: int,
        surfaces: PairRows = NO_ROWS,
        deformables: PairRows = NO_ROWS,
    ) -> bytes:
        """Return the bytes of the contacts in a penetration table, and of others beside them."""
        kinds = (point_rows(table), surfaces, deformables)
        pairs = tuple(ids.tobytes() for rows in kinds for ids in (rows.id_A, rows.id_B))
        if names is not self._names_of:
            self._take_names(names)
        if self._template is None or pairs != self._pairs:
            self._template, self._pairs = self._join(kinds, names), pairs
        template = self._template
        numbers = [rows.numbers.reshape(-1, 1) for rows in kinds if rows]
        if numbers:
            template.put_numbers(numbers[0] if len(numbers) == 1 else np.concatenate(numbers))
        template.put_stamp(stamp_ns)
        template.put_bytes(self._version, as_bytes(scene_version, np.uint64))
        return template.data()

    def prepare(self, table: Any, names: SceneNames) -> None:
        """Have the names of another version of the scene ready; any thread may call this.

        That is, of those that are known, and of the geometries in a penetration table.
        """
        known = self._kept_names(names)
        ids = np.unique(np.concatenate([table.id_A, table.id_B])).tolist()
        known.update(self._write_names([value for value in ids if value not in known], names))
        self._ready = (names, known)

    def _kept_names(self, names: SceneNames) -> _Texts:
        """Return the texts of unchanged names: these are not written anew."""
        return {
            value: (name, data)
            for value, (name, data) in list(self._names.items())
            if names.known_name(value) is name
        }

    def _take_names(self, names: SceneNames) -> None:
        """Follow another version of the scene."""
        ready, known = self._ready
        self._names = known if ready is names else self._kept_names(names)
        self._names_of, self._template = names, None

    def _join(self, kinds: Sequence[PairRows], names: SceneNames) -> Patchable:
        """Join the names of all pairs, with room for the numbers."""
        used = tuple(index for index, rows in enumerate(kinds) if rows)
        frame = self._frames.get(used)
        if frame is None:
            frame = self._frames[used] = self._probe(used)
        pieces, places, counts, position = [frame.parts[0]], [], [], len(frame.parts[0])
        for place, index, behind in zip(frame.counts, used, frame.parts[1:], strict=True):
            rows, room = kinds[index], bytes(8 * KINDS[index].width)
            counts.append((position - len(pieces[-1]) + place, len(rows)))
            texts = self._texts(np.stack([rows.id_A, rows.id_B], axis=1).ravel().tolist(), names)
            lengths = np.fromiter(map(len, texts), np.int64, len(texts)).reshape(-1, 2).sum(axis=1)
            ends = position + np.cumsum(lengths + len(room))
            places.append((ends[:, np.newaxis] + np.arange(-len(room), 0, 8)).ravel())
            contacts = [room] * (3 * len(rows))
            contacts[0::3], contacts[1::3] = texts[0::2], texts[1::2]
            pieces += (*contacts, behind)
            position = int(ends[-1]) + len(behind)
        everywhere = np.concatenate(places) if places else np.empty(0, dtype=np.int64)
        template = Patchable(b"".join(pieces), [frame.stamp], everywhere, 1)
        for place, count in counts:
            template.put_bytes(place, as_bytes(count, np.uint32))
        return template

    def _texts(self, ids: list[int], names: SceneNames) -> list[bytes]:
        """Return the bytes of the names of geometries."""
        try:
            return [self._names[value][1] for value in ids]
        except KeyError:
            unknown = list(dict.fromkeys(ids).keys() - self._names.keys())
            self._names.update(self._write_names(unknown, names))
            return [self._names[value][1] for value in ids]

    def _write_names(self, ids: Sequence[int], names: SceneNames) -> _Texts:
        """Serialize names, each filled up to where the next field begins."""
        if not ids:
            return {}
        kind = KINDS[0]
        blank = kind.make(GeometryName(), GeometryName(), [0.0] * kind.width)
        contacts = []
        for value in ids:
            contact, named = copy(blank), copy(names.geometry_name(value))
            named.id = value
            contact.geometry_a = named
            contacts.append(contact)
        message = ContactArray(points=contacts)
        fields, data = layout(message), self._serialize(message)
        begins, ends = (fields.begins(f"points.geometry_{each}.id") for each in "ab")
        return {
            value: (names.geometry_name(value), data[begin:end])
            for value, begin, end in zip(ids, begins, ends, strict=True)
        }

    def _probe(self, used: tuple[int, ...]) -> _Frame:
        """Find the bytes around contacts of some kinds, by one of each."""
        contacts = {}
        for index in used:
            kind = KINDS[index]
            contacts[kind.field] = [kind.make(GeometryName(), GeometryName(), [0.0] * kind.width)]
        message = self._array(contacts)
        fields, data = layout(message), self._serialize(message)
        parts, counts, position = [], [], 0
        for name in contacts:
            begin = fields.begin(f"{name}.geometry_a.id")
            parts.append(data[position:begin])
            counts.append(fields.begin(f"{name}[]") - position)
            position = fields.within(name)[-1].end
        return _Frame((*parts, data[position:]), tuple(counts), fields.begin("header.stamp.sec"))

    def _array(self, contacts: dict[str, Any]) -> ContactArray:
        return ContactArray(header=Header(frame_id=self._frame_id), **contacts)


class _Table(NamedTuple):
    """As much of a penetration table as markers show."""

    p_WCa: NDArray[np.float64]
    p_WCb: NDArray[np.float64]
    nhat_BA_W: NDArray[np.float64]
    depth: NDArray[np.float64]


class _Look(NamedTuple):
    """How contact markers look."""

    point_diameter: float
    normal_length: float


class _Before(NamedTuple):
    """The bytes before a marker's points, in which its stamp and their number are."""

    data: bytes
    stamp_at: int
    count_at: int


class ContactMarkerWire:
    """Serializes the markers of contacts, as ``contact_markers_to_msg`` and the serializer do."""

    def __init__(self, frame_id: str, serialize: Serializer) -> None:
        self._frame_id = frame_id
        self._serialize = serialize
        self._look: _Look | None = None
        self._before: list[_Before] = []
        self._behind = b""
        self._template: Patchable | None = None
        self._count = -1

    def message(
        self, table: Any, *, stamp_ns: int, point_diameter: float, normal_length: float
    ) -> bytes:
        """Return the bytes of the markers of the contacts in a penetration table."""
        look = _Look(point_diameter, normal_length)
        if look != self._look:
            self._probe(look)
            self._look, self._template = look, None
        count = len(table.depth)
        if self._template is None or count != self._count:
            self._template, self._count = self._make(count), count
        self._template.put_stamp(stamp_ns)
        if count:
            balls, lines = contact_points(table, normal_length)
            self._template.put_numbers(np.concatenate([balls, lines]))
        return self._template.data()

    def _make(self, count: int) -> Patchable:
        """Return the markers of so many contacts, with room for their points."""
        if count == 0:
            message = self._markers(0, _Look(1.0, 1.0))
            return Patchable(
                self._serialize(message), layout(message).begins(MARKER_STAMPS), [], 3
            )
        room = bytes(2 * count * _POINT)
        parts, stamps, counts, places, position = [], [], [], [], 0
        for before in self._before:
            stamps.append(position + before.stamp_at)
            counts.append(position + before.count_at)
            position += len(before.data)
            places += [position + _POINT * i for i in range(2 * count)]
            position += len(room)
            parts += [before.data, room]
        template = Patchable(b"".join([*parts, self._behind]), stamps, places, 3)
        for place in counts:
            template.put_bytes(place, as_bytes(2 * count, np.uint32))
        return template

    def _probe(self, look: _Look) -> None:
        """Find the bytes around the points of both markers, by one contact."""
        message = self._markers(1, look)
        fields, data = layout(message), self._serialize(message)
        # Of the ball at each end, and of the line between them.
        begins = fields.begins("markers.points.x")[::2]
        self._before, position = [], 0
        for begin, stamp, count in zip(
            begins, fields.begins(MARKER_STAMPS), fields.begins("markers.points[]"), strict=True
        ):
            self._before.append(_Before(data[position:begin], stamp - position, count - position))
            position = begin + 2 * _POINT
        self._behind = data[position:]

    def _markers(self, count: int, look: _Look) -> MarkerArray:
        points, depths = np.zeros((count, 3)), np.zeros(count)
        return contact_markers_to_msg(
            _Table(points, points, points, depths),
            stamp_ns=0,
            frame_id=self._frame_id,
            point_diameter=look.point_diameter,
            normal_length=look.normal_length,
        )
