"""Edits of several objects, as a whole or not at all: an undo log.

Where one assignment can't make an edit happen - a cost for each of many vertices - its undo
is said first, and done where the edit raises or is interrupted. To know that takes as long as the
change, and not as the whole table.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
import functools
import sys
from types import FrameType
from typing import Any, Concatenate, ParamSpec, Protocol, TypeVar

__all__ = ["Undo", "WholeEdits", "as_before", "whole_edit"]

Arguments = ParamSpec("Arguments")
T = TypeVar("T")

Undo = Callable[[], None]
"""Brings back what was before an edit; to do it twice changes nothing."""


def as_before(owner: object, names: Iterable[str]) -> Undo:
    """Return a function that restores attributes of an object, tables among them."""
    attributes = {name: _copied(getattr(owner, name)) for name in names}
    return functools.partial(vars(owner).update, attributes)


def _copied(value: Any) -> Any:
    """Return a copy of a table, or of a tuple of tables; all else is returned as it is."""
    if isinstance(value, tuple) and hasattr(value, "_fields"):
        return type(value)(*map(_copied, value))
    return value.copy() if isinstance(value, list | dict | set) else value


class WholeEdits:
    """Makes edits of objects that belong together, one after another."""

    def __init__(self) -> None:
        self._undos: list[Undo] = []
        """Of an edit that is under way, or was interrupted while it was undone."""
        self._frame: FrameType | None = None
        """Where that edit is made."""

    def settle(self) -> None:
        """Undo the remainder of an edit that was interrupted."""
        if self._undos and not self._is_inside():
            for undo in self._undos:
                undo()
            self._undos = []

    def make(self, undos: Callable[[], Iterable[Undo]], edit: Callable[[], T]) -> T:
        """Make an edit and return its answer; where it raises, nothing has changed.

        ``undos()`` undo it. An edit inside another is part of that one.
        """
        if self._is_inside():
            return edit()
        self.settle()
        before = list(undos())
        try:
            self._frame = sys._getframe()
            self._undos = before
            result = edit()
            self._undos = []  # it has happened
        except BaseException:
            self._frame = None
            self.settle()
            raise
        else:
            return result
        finally:
            self._frame = None

    def try_out(self, undos: Callable[[], Iterable[Undo]], edit: Callable[[], T]) -> T:
        """Make an edit for as long as it takes to compute something with it; it is undone."""
        self.settle()
        try:
            self._undos = list(undos())
            return edit()
        finally:
            self.settle()

    def _is_inside(self) -> bool:
        """Tell whether an edit that is under way calls this."""
        if self._frame is None:
            return False
        frame: FrameType | None = sys._getframe()
        while frame is not None and frame is not self._frame:
            frame = frame.f_back
        return frame is not None


class _Edited(Protocol):
    """An object that is edited as a whole."""

    @property
    def _whole_edits(self) -> WholeEdits: ...

    def _undos(self) -> Iterable[Undo]: ...


E = TypeVar("E", bound=_Edited)


def whole_edit(
    method: Callable[Concatenate[E, Arguments], T],
) -> Callable[Concatenate[E, Arguments], T]:
    """Have a method, whose changes its object's ``_undos`` bring back, do all or nothing."""

    @functools.wraps(method)
    def made(owner: E, *arguments: Arguments.args, **named: Arguments.kwargs) -> T:
        return owner._whole_edits.make(
            owner._undos, functools.partial(method, owner, *arguments, **named)
        )

    return made
