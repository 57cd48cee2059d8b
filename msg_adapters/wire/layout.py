"""Where each field of a message is among its bytes, by the rules of CDR.

Messages travel in the first version of the Common Data Representation (DDS-XTypes 1.3, section
7.4.1, encoding version 1): behind a header of four bytes, fields follow each other in the order of
their definition; a number begins at a multiple of its own size, counted from the end of the
header; a string is its length with the closing zero, its bytes in UTF-8 and that zero; a sequence
is its length and its elements. Bytes between fields may be anything.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from rosidl_parser.definition import (
    AbstractSequence,
    AbstractString,
    Array,
    BasicType,
    NamespacedType,
)

__all__ = ["HEADER", "Field", "Layout", "layout"]

HEADER = 4
"""Bytes before the first field, which name the representation."""

_COUNT = 4
"""Bytes of the length of a string or of a sequence."""

_SIZES = {
    "boolean": 1,
    "octet": 1,
    "char": 1,
    "int8": 1,
    "uint8": 1,
    "int16": 2,
    "uint16": 2,
    "int32": 4,
    "uint32": 4,
    "int64": 8,
    "uint64": 8,
    "float": 4,
    "double": 8,
}
"""Bytes of the numbers of interface definitions."""


class Field(NamedTuple):
    """Bytes ``begin`` to ``end`` of a message, header included.

    ``path`` has the names of the fields that lead there, without indices:
    ``markers.header.stamp.sec``. The length of a string or sequence is a field of its own, with
    ``[]`` behind the name; numbers in a row are one field.
    """

    path: str
    begin: int
    end: int


class Layout:
    """The fields of one message, in the order of their bytes."""

    def __init__(self, fields: list[Field]) -> None:
        self.fields = fields
        self.size = fields[-1].end if fields else HEADER

    def begins(self, path: str) -> list[int]:
        """Return the beginnings of the fields with a path, one of each element of a sequence."""
        return [field.begin for field in self.fields if field.path == path]

    def begin(self, path: str) -> int:
        """Return the beginning of the only field with a path; ValueError for none or many."""
        (begin,) = self.begins(path)
        return begin

    def within(self, path: str) -> list[Field]:
        """Return the field with a path, or those of the messages in it, for all elements."""
        inner = f"{path}."
        return [f for f in self.fields if f.path == path or f.path.startswith(inner)]

    def is_padding(self) -> NDArray[np.bool_]:
        """Return a mask ``(size,)`` of the bytes of no field, the header's options included."""
        result = np.ones(self.size, dtype=np.bool_)
        result[: HEADER // 2] = False
        for field in self.fields:
            result[field.begin : field.end] = False
        return result


def layout(message: Any, begin: int = HEADER) -> Layout:
    """Return the places of the fields of a message once it is serialized.

    A message within another one may ``begin`` elsewhere than behind the header. Raises TypeError
    for a field of a type that definitions of interfaces don't have: wide characters and numbers of
    16 bytes.
    """
    fields: list[Field] = []
    _put_members(message, "", begin, fields)
    return Layout(fields)


_Put = Callable[[Any, str, int, list[Field]], int]
"""Appends the fields of a value that follow a position; returns the position behind them."""


def _put_members(message: Any, prefix: str, position: int, fields: list[Field]) -> int:
    members = _members(type(message))  # type: ignore[arg-type]
    if not members:  # a structure has at least one: a byte
        fields.append(
            Field(prefix + "structure_needs_at_least_one_member", position, position + 1)
        )
        return position + 1
    for name, put in members:
        position = put(getattr(message, name), prefix + name, position, fields)
    return position


@cache
def _members(kind: Any) -> tuple[tuple[str, _Put], ...]:
    names, slots = kind.get_fields_and_field_types(), kind.SLOT_TYPES
    return tuple((name, _put_of(slot)) for name, slot in zip(names, slots, strict=True))


def _put_of(slot: Any) -> _Put:
    """Return the rule for a field of a type."""
    if isinstance(slot, BasicType):
        return _numbers(slot, lambda value: 1)
    if isinstance(slot, AbstractString):
        return _put_string
    if isinstance(slot, NamespacedType):
        return lambda value, path, position, fields: _put_members(
            value, f"{path}.", position, fields
        )
    if isinstance(slot, (Array, AbstractSequence)):
        elements = _elements(slot.value_type)
        return elements if isinstance(slot, Array) else _counted(elements)
    raise TypeError(f"fields of the type {slot!r} have no place in a message")


def _elements(slot: Any) -> _Put:
    if isinstance(slot, BasicType):
        return _numbers(slot, len)
    put = _put_of(slot)

    def put_each(values: Any, path: str, position: int, fields: list[Field]) -> int:
        for value in values:
            position = put(value, path, position, fields)
        return position

    return put_each


def _numbers(slot: Any, count_of: Callable[[Any], int]) -> _Put:
    size = _SIZES.get(slot.typename)
    if size is None:
        raise TypeError(f"numbers of the type {slot.typename!r} have no place in a message")

    def put(value: Any, path: str, position: int, fields: list[Field]) -> int:
        count = count_of(value)
        # Without elements nothing is aligned.
        begin = _aligned(position, size) if count else position
        fields.append(Field(path, begin, begin + size * count))
        return begin + size * count

    return put


def _put_string(value: str, path: str, position: int, fields: list[Field]) -> int:
    begin = _put_count(path, position, fields)
    end = begin + len(value.encode()) + 1
    fields.append(Field(path, begin, end))
    return end


def _counted(elements: _Put) -> _Put:
    return lambda values, path, position, fields: elements(
        values, path, _put_count(path, position, fields), fields
    )


def _put_count(path: str, position: int, fields: list[Field]) -> int:
    begin = _aligned(position, _COUNT)
    fields.append(Field(f"{path}[]", begin, begin + _COUNT))
    return begin + _COUNT


def _aligned(position: int, size: int) -> int:
    return position + -(position - HEADER) % size
