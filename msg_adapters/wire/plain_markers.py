"""Pieces of plain markers in bytes: many at once, from one that the serializer made.

Markers without lists, texts and files differ in their names, numbers and colours only. One is
serialized for each length of name; the others are copies of it, written over by numpy.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from visualization_msgs.msg import Marker

from msg_adapters.plain_look import PlainLook
from msg_adapters.wire.layout import layout
from msg_adapters.wire.marker_fill import marker_before

__all__ = ["Piece", "PlainPieces"]

_NO_POSE = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


class Piece(NamedTuple):
    """A marker in bytes; ``stamp`` and ``pose`` are places in it."""

    data: bytes
    stamp: int
    pose: int


class _Template(NamedTuple):
    """A marker in bytes, and where the fields that vary begin: id, type and action in a row."""

    data: NDArray[np.uint8]
    ns: int
    integers: int
    pose: int
    size: int
    color: int


class PlainPieces:
    """Makes pieces of plain markers in one frame."""

    def __init__(self, array: Callable[[list[Marker]], bytes], frame_id: str) -> None:
        """Serialize with ``array``."""
        self._array, self._frame_id = array, frame_id
        self._templates: dict[tuple[int, int], _Template] = {}

    def make(self, looks: Sequence[PlainLook], alignment: int) -> list[Piece]:
        """Return a piece for each, for a place modulo 8."""
        names = [look.ns.encode() for look in looks]
        groups = defaultdict(list)
        for index, name in enumerate(names):
            groups[len(name)].append(index)
        result = {}
        for length, members in groups.items():
            template = self._template(length, alignment)
            rows = _fill(template, [looks[i] for i in members], [names[i] for i in members])
            for index, row in zip(members, rows, strict=True):
                result[index] = Piece(row.tobytes(), 0, template.pose)
        return [result[index] for index in range(len(looks))]

    def _template(self, length: int, alignment: int) -> _Template:
        template = self._templates.get((length, alignment))
        if template is None:
            template = self._make_template(length, alignment)
            self._templates[length, alignment] = template
        return template

    def _make_template(self, length: int, alignment: int) -> _Template:
        look = PlainLook("x" * length, 0, 0, Marker.ADD, (0.0,) * 3, (0.0,) * 4)
        marker = look.marker(self._frame_id)
        fields = layout(marker, alignment)
        data = self._array([marker_before(alignment), marker])
        return _Template(
            np.frombuffer(data, np.uint8)[len(data) - (fields.size - alignment) :],
            *(
                fields.begin(path) - alignment
                for path in ("ns", "id", "pose.position.x", "scale.x", "color.r")
            ),
        )


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
    put(template.pose, [_NO_POSE] * len(looks), np.float64)
    put(template.size, [look.size for look in looks], np.float64)
    put(template.color, [look.color for look in looks], np.float32)
    return rows
