"""Identifiers: hashable, ordered values that are never given out twice in a process."""

from __future__ import annotations

import itertools
import numbers
from typing import Any, TypeVar

from scene_graph_ros.geometry.quoting import quoted

__all__ = ["FilterId", "FrameId", "GeometryId", "Identifier", "SourceId", "continue_after"]

_counters = [itertools.count(1)]
"""The one that gives out the next id."""


def continue_after(value: int) -> None:
    """Give out ids larger than ``value`` from now on, as another process did that is repeated.

    For a process that does nothing else. Raises ValueError where larger ones were given out.
    """
    newest = next(_counters[0])
    _counters[0] = itertools.count(max(newest, value) + 1)
    if newest > value + 1:
        raise ValueError(f"id {newest - 1} was given out already, later than {value}")


Self = TypeVar("Self", bound="Identifier")


class Identifier:
    """A positive integer with a type. Ids of different types are never equal.

    ``FrameId()`` without a value is the invalid id, which names nothing.
    """

    __slots__ = ("_value",)
    _value: int

    def __init__(self, value: int = 0) -> None:
        given: Any = value
        if isinstance(given, bool) or not isinstance(given, numbers.Integral) or given < 0:
            raise ValueError(
                f"{type(self).__name__}: value must be a non-negative integer: {quoted(given)}"
            )
        object.__setattr__(self, "_value", int(given))

    @classmethod
    def get_new_id(cls: type[Self]) -> Self:
        """Return an id different from all before it, of any type, and larger. Thread safe."""
        return cls(next(_counters[0]))

    def get_value(self) -> int:
        """Return the integer. Raises ValueError for the invalid id."""
        if not self._value:
            raise ValueError(f"{type(self).__name__}() is invalid and has no value")
        return self._value

    def is_valid(self) -> bool:
        """Tell whether this id was ever given out for something."""
        return self._value > 0

    def __int__(self) -> int:
        return self._value

    def __hash__(self) -> int:
        return hash(self._value)

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return self._value == other._value

    def __lt__(self: Self, other: Self) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return self._value < other._value

    def __le__(self: Self, other: Self) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return self._value <= other._value

    def __gt__(self: Self, other: Self) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return self._value > other._value

    def __ge__(self: Self, other: Self) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return self._value >= other._value

    def __setattr__(self, name: str, value: Any) -> None:
        raise AttributeError(f"{type(self).__name__} is immutable: cannot set {name!r}")

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self._value,)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self._value or ''})"


class SourceId(Identifier):
    """The id of a source: the token with which it changes its objects."""

    __slots__ = ()


class FrameId(Identifier):
    """The id of a frame."""

    __slots__ = ()


class GeometryId(Identifier):
    """The id of a geometry."""

    __slots__ = ()


class FilterId(Identifier):
    """The id of a transient collision filter declaration."""

    __slots__ = ()
