"""Poses straight from the bytes of a message, by layouts of messages that came before.

Publishers send the same names again and again. Such messages have a *layout* in common: bytes that
are always the same, the places of stamps, and those of numbers. Of a message that
fits a known layout one kernel reads all poses; the others are for the ordinary deserializer.

Serializers leave old memory in the bytes between fields, which are not compared.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from msg_adapters.poses import (
    are_usable_joints,
    JointBatch,
    joints_from_components,
    meant_name,
    pose_batch,
    PoseBatch,
)
from msg_adapters.wire.fields import Serializer
from msg_adapters.wire.layout import layout
from msg_adapters.wire.pose_kinds import POSE_KINDS
from scene_graph_ros.geometry.spatial.record_kernels import are_valid, place_records

__all__ = ["Layout", "PoseWire"]

_LAYOUTS_KEPT = 4096
"""Layouts remembered per topic: each object of a large scene may have a message of its own."""

_SEEN_KEPT = 256
"""Sets of names remembered to notice when one comes again."""

_NANOSECONDS = 10**9
_STAMP_SIZE = 8
"""Bytes: seconds and nanoseconds."""


@dataclass(frozen=True, eq=False)
class _Places:
    """Where things are in all messages of the same lengths of names.

    ``constants`` are the places of the bytes that tell names and counts; beyond the last number
    nothing is looked at. Of the numbers the first place is kept, and where they are not in a row,
    the places of all their bytes.
    """

    constants: NDArray[np.int64]
    stamps: tuple[int, ...]
    first_number: int
    count: int
    gather: NDArray[np.int64] | None

    def key(self, data: bytes) -> bytes:
        """Return the bytes that say which layout a message has."""
        return np.frombuffer(data, np.uint8)[self.constants].tobytes()

    def is_like(self, other: _Places) -> bool:
        """Tell whether all places are the same."""
        mine = (self.stamps, self.first_number, self.count)
        return mine == (other.stamps, other.first_number, other.count) and np.array_equal(
            self.constants, other.constants
        )

    def numbers(self, data: bytes) -> NDArray[np.float64]:
        """Return all numbers of a message."""
        if self.gather is None:
            return np.frombuffer(data, np.float64, self.count, self.first_number)
        return np.frombuffer(data, np.uint8)[self.gather].view(np.float64)

    def rows(self, width: int) -> NDArray[np.int64] | None:
        """Return the first place of each row of ``width`` numbers, None where one is apart."""
        if self.gather is None:
            return self.first_number + 8 * width * np.arange(self.count // width)
        rows = self.gather.reshape(-1, 8 * width)
        is_in_row = np.all(np.diff(rows, axis=1) == 1)
        return rows[:, 0].copy() if is_in_row else None

    def stamp(self, data: bytes, index: int = 0) -> int:
        """Return one of the stamps in nanoseconds."""
        place = self.stamps[index]
        seconds = int.from_bytes(data[place : place + 4], _ORDER, signed=True)
        return seconds * _NANOSECONDS + int.from_bytes(data[place + 4 : place + 8], _ORDER)


_ORDER: Any = "little" if np.dtype("=i4") == np.dtype("<i4") else "big"


@dataclass(frozen=True, eq=False)
class Layout:
    """The layout of messages with the same names: compare layouts by identity."""

    places: _Places
    names: tuple[str, ...]
    parents: tuple[str, ...]
    """As they are meant, without leading slashes."""
    width: int

    def stamp(self, data: bytes) -> int:
        """Return the newest stamp of a message of this layout in nanoseconds."""
        return max(self.places.stamp(data, i) for i in range(len(self.places.stamps)))

    def has_times(self, data: bytes) -> bool:
        """Tell whether no stamp of a message has a second or more in its nanoseconds."""
        return all(
            int.from_bytes(data[place + 4 : place + 8], _ORDER) < _NANOSECONDS
            for place in self.places.stamps
        )

    def poses(self, data: bytes, names: tuple[str, ...] | None = None) -> PoseBatch:
        """Return the poses of a message, which ``names`` names where it does not itself."""
        places = self.places
        rows = places.numbers(data).reshape(-1, self.width)
        if len(places.stamps) == 1:
            stamps = np.full(len(rows), places.stamp(data), dtype=np.int64)
        else:
            each = [places.stamp(data, i) for i in range(len(places.stamps))]
            stamps = np.array(each, dtype=np.int64)
        return pose_batch(self.names if names is None else names, self.parents, stamps, rows)

    @cached_property
    def _records(self) -> tuple[NDArray[np.int64], NDArray[np.int64]] | None:
        """Where the numbers of each pose begin, and the stamps of each or of all.

        None where a kernel can't read them so.
        """
        numbers = self.places.rows(self.width)
        stamps = np.array(self.places.stamps, dtype=np.int64)
        if numbers is None or len(stamps) not in (1, len(numbers)):
            return None
        return (numbers, stamps) if np.all(stamps < numbers) else None

    def place_poses(
        self,
        data: bytes,
        rows: NDArray[np.int64],
        limits: tuple[int, int, int],
        X_PF: NDArray[np.float64],
        stamps: NDArray[np.int64],
    ) -> bool:
        """Write the poses of a message to ``rows`` of ``X_PF`` ``(n, 4, 4)``, in one go.

        Their stamps go to ``stamps`` ``(n,)``. ``limits`` are the stamp of poses without one, the
        earliest and the latest that is right, in nanoseconds; nor may a pose be older than that
        which it replaces. Returns whether there is nothing against any pose; else nothing was
        written.
        """
        records = self._records
        if records is None:
            return False
        return bool(place_records(data, *records, limits, rows, X_PF, stamps))

    def is_clean(self, data: bytes) -> bool:
        """Tell whether no number of a message is reason to refuse a part of it."""
        if not self.has_times(data):
            return False
        if self.width == 1:
            return are_usable_joints(self.places.numbers(data))
        if self._records is None:
            return not self.poses(data).refused
        return bool(are_valid(data, self._records[0]))

    def joints(self, data: bytes) -> JointBatch:
        """Return the joint positions of a JointState."""
        places = self.places
        return joints_from_components(self.names, places.numbers(data), places.stamp(data))


class _Recent(NamedTuple):
    """The bytes before the numbers of the last message of a size, without its stamps.

    A publisher that sends the same names sends the same bytes; then nothing else is compared.
    """

    layout: Layout
    texts: tuple[tuple[int, bytes], ...]
    """Where they begin, and the bytes."""

    @classmethod
    def of(cls, layout: Layout, data: bytes) -> _Recent | None:
        """Return those of a message, None where bytes between numbers tell, too."""
        places = layout.places
        if places.gather is not None or max(places.stamps, default=0) > places.first_number:
            return None
        inner = [p for stamp in places.stamps for p in (stamp, stamp + _STAMP_SIZE)]
        edges = [0, *inner, places.first_number]
        spans = zip(edges[::2], edges[1::2], strict=True)
        return cls(layout, tuple((begin, data[begin:end]) for begin, end in spans))

    def fits(self, data: bytes) -> bool:
        """Tell whether a message of the same size has the same bytes."""
        return all(data.startswith(text, begin) for begin, text in self.texts)


class PoseWire:
    """The layouts of one topic.

    ``find`` is asked for every message, ``learn`` is told every message that ``find`` did not
    know and that turned out to be fine; a layout is made when the same names come again.
    """

    def __init__(self, pose_type: str, serialize: Serializer) -> None:
        self._kind = POSE_KINDS[pose_type]
        self._serialize = serialize
        self._places: dict[int, list[_Places]] = {}
        self._layouts: dict[tuple[int, bytes], Layout] = {}
        self._seen: dict[tuple[Any, ...], None] = {}
        self._recent: dict[int, _Recent | None] = {}

    def find(self, data: bytes) -> Layout | None:
        """Return the layout of a message, or None where it is not known."""
        size = len(data)
        recent = self._recent.get(size)
        if recent is not None and recent.fits(data):
            return recent.layout
        for places in self._places.get(size, ()):
            layout = self._layouts.get((size, places.key(data)))
            if layout is not None and layout.places is places:
                self._recent[size] = _Recent.of(layout, data)
                return layout
        return None

    def learn(self, data: bytes, message: Any) -> None:
        """Take note of a message that was read the ordinary way."""
        kind = self._kind
        names, parents = tuple(kind.names(message)), tuple(kind.parents(message))
        key = (len(data), names, parents)
        if key not in self._seen:
            while len(self._seen) >= _SEEN_KEPT:
                del self._seen[next(iter(self._seen))]
            self._seen[key] = None
            return
        del self._seen[key]
        meant, within = tuple(map(meant_name, names)), tuple(map(meant_name, parents))
        # What names a thing twice is to be looked at each time.
        is_plain = len(set(meant)) == len(meant)
        places = self._find_places(data, message) if is_plain else None
        if places is not None:
            self._remember(Layout(places, meant, within, kind.width), data)

    def _remember(self, found: Layout, data: bytes) -> None:
        """Keep a layout, with the places of others like it."""
        if len(self._layouts) >= _LAYOUTS_KEPT:
            self._layouts.clear()
            self._places.clear()
        self._recent.pop(len(data), None)
        if not self._layouts:
            self._recent.clear()
        places = found.places
        known = self._places.setdefault(len(data), [])
        same = next((one for one in known if one.is_like(places)), None)
        if same is None:
            known.append(places)
        places = same or places
        self._layouts[len(data), places.key(data)] = replace(found, places=places)

    def _find_places(self, data: bytes, message: Any) -> _Places | None:
        """Return the places of stamps and numbers; None where ``message`` can't be read so.

        That is without numbers, and where its bytes are not those of the serializer: of another
        order, by another representation, or with a name in another alphabet than UTF-8.
        """
        fields = layout(message)
        numbers = [field for path in self._kind.numbers for field in fields.within(path)]
        end = max((field.end for field in numbers if field.end > field.begin), default=0)
        is_field = ~fields.is_padding()[:end]
        ours = _bytes(self._serialize(message))
        if not (0 < end <= min(len(data), len(ours))):
            return None
        if not np.array_equal(ours[:end][is_field], _bytes(data)[:end][is_field]):
            return None
        is_number = np.zeros(end, dtype=np.bool_)
        for field in numbers:
            is_number[field.begin : field.end] = True
        is_constant = is_field & ~is_number
        stamps = fields.begins(self._kind.stamps)
        for place in stamps:
            is_constant[place : place + _STAMP_SIZE] = False
        gather = np.flatnonzero(is_number)
        first = int(gather[0])
        is_in_row = end - first == len(gather)
        return _Places(
            np.flatnonzero(is_constant),
            tuple(stamps),
            first,
            len(gather) // 8,
            None if is_in_row else gather,
        )


def _bytes(data: bytes) -> NDArray[np.uint8]:
    return np.frombuffer(data, np.uint8)
