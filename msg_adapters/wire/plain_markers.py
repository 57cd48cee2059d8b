"""Pieces of plain markers in bytes: many at once, from one that the serializer made.

Markers without lists, texts and files differ in their names, numbers and colours only. One with
marks in all of them is serialized for each length of name; the others are copies of it, written
over by numpy.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

from geometry_msgs.msg import Point, Pose, Quaternion
import numpy as np
from numpy.typing import NDArray
from visualization_msgs.msg import Marker

from msg_adapters.plain_look import PlainLook
from msg_adapters.wire.fields import (
    as_bytes,
    find_once,
    marked_numbers,
    marked_stamps,
    MARKED_TIME,
)

__all__ = ["Piece", "PlainPieces", "marked_pose"]

_POSE = 7
_NUMBERS = _POSE + 3
"""Of a marker: those of its pose, and its size."""

_MARKED_INTEGERS = (0x1C2D3E4F, 0x2C3D4E5F, 0x3C4D5E6F)
"""Of id, type and action, which follow each other. Together they are longer than any padding, in
which the serializer leaves remains of other messages."""

_MARKED_COLOR = np.array([-1.5, -2.25, -3.125, -4.0625], np.float32) * np.float32(1e-30)
_MARKED_NAME = "#Mark?"
_SHORTEST_NAME = 2 * len(_MARKED_NAME)
"""Bytes of a namespace, below which its mark could be taken for something else."""

_NO_POSE = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


class Piece(NamedTuple):
    """A marker in bytes; ``stamp`` and ``pose`` are places in it."""

    data: bytes
    stamp: int
    pose: int


class _Template(NamedTuple):
    """A marked marker in bytes, and where its marks are."""

    data: NDArray[np.uint8]
    ns: int
    integers: int
    numbers: int
    size: int
    color: int


class PlainPieces:
    """Makes pieces of plain markers in one frame."""

    def __init__(
        self, array: Callable[[list[Marker]], bytes], before: Mapping[int, Marker], frame_id: str
    ) -> None:
        """Serialize with ``array``; behind ``before[k]`` a marker begins at k modulo 8."""
        self._array, self._before, self._frame_id = array, before, frame_id
        self._templates: dict[tuple[int, int], _Template] = {}

    def make(self, looks: Sequence[PlainLook], alignment: int) -> list[Piece | None]:
        """Return a piece for each, None where the name is too short, for a place modulo 8."""
        result: list[Piece | None] = [None] * len(looks)
        names = [look.ns.encode() for look in looks]
        groups = defaultdict(list)
        for index, name in enumerate(names):
            groups[len(name)].append(index)
        for length, members in groups.items():
            if length < _SHORTEST_NAME:
                continue
            template = self._template(length, alignment)
            rows = _fill(template, [looks[i] for i in members], [names[i] for i in members])
            for index, row in zip(members, rows, strict=True):
                result[index] = Piece(row.tobytes(), 0, template.numbers)
        return result

    def _template(self, length: int, alignment: int) -> _Template:
        template = self._templates.get((length, alignment))
        if template is None:
            template = self._make_template(length, alignment)
            self._templates[length, alignment] = template
        return template

    def _make_template(self, length: int, alignment: int) -> _Template:
        numbers = marked_numbers(_NUMBERS)
        name = (_MARKED_NAME * (length // len(_MARKED_NAME) + 1))[:length]
        r, g, b, a = _MARKED_COLOR.tolist()
        x, y, z = numbers[_POSE:]
        look = PlainLook(name, *_MARKED_INTEGERS, (x, y, z), (r, g, b, a))
        marker = look.marker(self._frame_id)
        marker.header.stamp, marker.pose = MARKED_TIME, marked_pose(numbers[:_POSE])
        data = self._array([self._before[alignment], marker])
        (begin,) = marked_stamps(data)
        piece = data[begin:]
        return _Template(
            np.frombuffer(piece, np.uint8),
            find_once(piece, name.encode()),
            find_once(piece, as_bytes(_MARKED_INTEGERS, np.int32)),
            find_once(piece, as_bytes(numbers[:_POSE], np.float64)),
            find_once(piece, as_bytes(numbers[_POSE:], np.float64)),
            find_once(piece, _MARKED_COLOR.tobytes()),
        )


def marked_pose(numbers: Sequence[float]) -> Pose:
    """Return the message of x, y, z, qx, qy, qz, qw."""
    x, y, z, qx, qy, qz, qw = numbers
    return Pose(position=Point(x=x, y=y, z=z), orientation=Quaternion(x=qx, y=qy, z=qz, w=qw))


def _fill(
    template: _Template, looks: Sequence[PlainLook], names: Sequence[bytes]
) -> NDArray[np.uint8]:
    """Return the bytes of one marker per row, all with names of the same length."""
    rows = np.tile(template.data, (len(looks), 1))

    def put(place: int, values: Any, dtype: Any) -> None:
        data = np.ascontiguousarray(values, dtype=dtype).reshape(len(looks), -1).view(np.uint8)
        rows[:, place : place + data.shape[1]] = data

    put(template.ns, np.frombuffer(b"".join(names), np.uint8), np.uint8)
    put(template.integers, [(look.id, look.type, look.action) for look in looks], np.int32)
    put(template.numbers, [_NO_POSE] * len(looks), np.float64)
    put(template.size, [look.size for look in looks], np.float64)
    put(template.color, [look.color for look in looks], np.float32)
    return rows
