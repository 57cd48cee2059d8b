"""Writes to tables that are decided first, and then done as a whole, however often."""

from __future__ import annotations

from typing import Any

__all__ = ["Writes"]

_DROPPED: Any = object()
"""Instead of a value: the key goes."""


class _Attributes:
    """The attributes of an object, to write to as to a dict.

    Not ``vars``: an object whose dict somebody has seen keeps it, and is slower to read for good.
    """

    __slots__ = ("_owner",)

    def __init__(self, owner: Any) -> None:
        self._owner = owner

    def __setitem__(self, name: str, value: Any) -> None:
        setattr(self._owner, name, value)


class Writes:
    """Writes to dicts, arrays and attributes, in the order in which they are to be done."""

    __slots__ = ("_writes",)

    def __init__(self) -> None:
        self._writes: list[tuple[Any, Any, Any]] = []

    def put(self, *entries: tuple[Any, Any, Any]) -> None:
        """Write entries of dicts or arrays: each is a table, a key and a value."""
        self._writes += entries

    def drop(self, table: dict[Any, Any], key: Any) -> None:
        """Remove an entry of a dict, if it is there by then."""
        self._writes.append((table, key, _DROPPED))

    def move_to_end(self, table: dict[Any, Any], key: Any, value: Any) -> None:
        """Write an entry of a dict, which then comes last."""
        self._writes += ((table, key, _DROPPED), (table, key, value))

    def set(self, owner: Any, name: str, value: Any) -> None:
        """Write an attribute."""
        self._writes.append((_Attributes(owner), name, value))

    def write(self) -> None:
        """Do all writes. To do them once more, from the first to the last, changes nothing."""
        for table, key, value in self._writes:
            if value is _DROPPED:
                table.pop(key, None)
            else:
                table[key] = value
