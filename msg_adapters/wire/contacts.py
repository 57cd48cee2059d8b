"""Contacts and their markers as bytes: templates from the serializer, numbers put in by numpy.

Names of geometries are serialized once and joined for the pairs that touch; stamps and
coordinates, which vary at each update, are written over. Where the pairs are the same as last
time, nothing is joined either. Places are found by marks (see ``wire.fields``).
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray
from std_msgs.msg import Header

from msg_adapters.contact_rows import KINDS, NO_ROWS, PairRows, point_rows
from msg_adapters.contacts import contact_markers_to_msg, contact_points
from msg_adapters.names import SceneNames
from msg_adapters.wire.fields import (
    as_bytes,
    find_count,
    find_once,
    marked_numbers,
    marked_stamps,
    MARKED_TIME,
    Patchable,
    Serializer,
)
from scene_graph_msgs.msg import ContactArray, GeometryName

__all__ = ["ContactMarkerWire", "ContactWire"]

_MARKED_IDS = (0x1B2C3D4E5F607182, 0x2B3C4D5E6F708192)
_MARKED_VERSION = 0x3C4D5E6F708192A3


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
    version: int


class ContactWire:
    """Serializes all contacts of a scene, as ``contacts_to_msg`` and the serializer do."""

    def __init__(self, frame_id: str, serialize: Serializer) -> None:
        self._frame_id = frame_id
        self._serialize = serialize
        self._frames: dict[tuple[int, ...], _Frame] = {}
        self._version = find_once(self._array({}), as_bytes(_MARKED_VERSION, np.uint64))
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
        blank = kind.make(GeometryName(), GeometryName(id=_MARKED_IDS[1]), [0.0] * kind.width)
        contacts = []
        for value in ids:
            contact, marked = copy(blank), copy(names.geometry_name(value))
            marked.id = _MARKED_IDS[0]
            contact.geometry_a = marked
            contacts.append(contact)
        data = self._serialize(ContactArray(points=contacts))
        first, second = (as_bytes(i, np.uint64) for i in _MARKED_IDS)
        result: _Texts = {}
        end = 0
        for value in ids:
            begin = data.index(first, end) + len(first)
            end = data.index(second, begin)
            text = as_bytes(value, np.uint64) + data[begin:end]
            result[value] = (names.geometry_name(value), text)
        return result

    def _probe(self, used: tuple[int, ...]) -> _Frame:
        """Find the bytes around contacts of some kinds, by one and by two of each."""
        marks = marked_numbers(sum(KINDS[index].width for index in used))
        contacts, ends, start = {}, [], 0
        for index in used:
            kind = KINDS[index]
            numbers = marks[start : start + kind.width]
            start += kind.width
            name = GeometryName(id=_MARKED_IDS[0] + index)
            contacts[kind.field] = kind.make(name, GeometryName(), numbers)
            ends.append((as_bytes(name.id, np.uint64), as_bytes(numbers, np.float64)))
        one, two = (self._array({f: [c] * n for f, c in contacts.items()}) for n in (1, 2))
        parts, counts, position, shift = [], [], 0, 0
        for first, last in ends:
            begin, end = find_once(one, first), find_once(one, last) + len(last)
            parts.append(one[position:begin])
            counts.append(find_count(parts[-1], two[position + shift : begin + shift]))
            position, shift = end, shift + end - begin
        (stamp,) = marked_stamps(one)
        return _Frame((*parts, one[position:]), tuple(counts), stamp, self._version)

    def _array(self, contacts: dict[str, Any]) -> bytes:
        header = Header(stamp=MARKED_TIME, frame_id=self._frame_id)
        return self._serialize(
            ContactArray(header=header, scene_version=_MARKED_VERSION, **contacts)
        )


class _Table(NamedTuple):
    """As much of a penetration table as markers show."""

    p_WCa: NDArray[np.float64]
    p_WCb: NDArray[np.float64]
    nhat_BA_W: NDArray[np.float64]
    depth: NDArray[np.float64]


def _marked_table(count: int) -> _Table:
    """Return contacts at marked points, whose lines have no length."""
    points = np.array(marked_numbers(6 * count)).reshape(2, count, 3)
    return _Table(points[0], points[1], np.zeros((count, 3)), np.zeros(count))


class _Look(NamedTuple):
    """How contact markers look."""

    point_diameter: float
    normal_length: float


def _ends(data: bytes, count: int, look: _Look) -> list[tuple[int, int]]:
    """Return the beginnings and ends of both markers' points, of ``count`` marked contacts."""
    points = contact_points(_marked_table(count), look.normal_length)
    patterns = [as_bytes(each, np.float64) for each in points]
    begins = [find_once(data, pattern) for pattern in patterns]
    return [(b, b + len(p)) for b, p in zip(begins, patterns, strict=True)]


def _around(data: bytes, ends: list[tuple[int, int]]) -> tuple[bytes, bytes, bytes]:
    """Return the bytes before, between and behind the points of both markers."""
    (a, b), (c, d) = ends
    return data[:a], data[b:c], data[d:]


class ContactMarkerWire:
    """Serializes the markers of contacts, as ``contact_markers_to_msg`` and the serializer do."""

    def __init__(self, frame_id: str, serialize: Serializer) -> None:
        self._frame_id = frame_id
        self._serialize = serialize
        self._look: _Look | None = None
        self._parts = (b"", b"", b"")
        self._counts: tuple[int, ...] = ()
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
            data = self._serialize_marked(_marked_table(0), _Look(1.0, 1.0))
            return Patchable(data, marked_stamps(data), [], 3)
        room = bytes(2 * count * 24)
        head, middle, tail = self._parts
        data = b"".join([head, room, middle, room, tail])
        first, second = len(head), len(head) + len(room) + len(middle)
        places = [start + 24 * i for start in (first, second) for i in range(2 * count)]
        template = Patchable(data, marked_stamps(data), places, 3)
        for start, place in zip((0, first + len(room)), self._counts, strict=True):
            template.put_bytes(start + place, as_bytes(2 * count, np.uint32))
        return template

    def _probe(self, look: _Look) -> None:
        """Find the bytes before, between and behind the points of both markers."""
        one, two = (self._serialize_marked(_marked_table(n), look) for n in (1, 2))
        ends = [_ends(data, n, look) for data, n in ((one, 1), (two, 2))]
        self._parts, more = (_around(d, e) for d, e in zip((one, two), ends, strict=True))
        self._counts = (
            find_count(self._parts[0], more[0], 2),
            find_count(self._parts[1], more[1], 2),
        )

    def _serialize_marked(self, table: Any, look: _Look) -> bytes:
        message = contact_markers_to_msg(
            table,
            stamp_ns=0,
            frame_id=self._frame_id,
            point_diameter=look.point_diameter,
            normal_length=look.normal_length,
        )
        for marker in message.markers:
            marker.header.stamp = MARKED_TIME
        return self._serialize(message)
