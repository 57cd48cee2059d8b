"""Which public methods of a class some actions call: so that none is in no test."""

from __future__ import annotations

from collections.abc import Callable, Iterable
import inspect
import sys
from types import CodeType, FrameType
from typing import Any

__all__ = ["uncalled_methods"]


def _codes_of(kind: type) -> dict[str, set[CodeType]]:
    """Return the code of each public method and property of a class, those of setters, too."""
    found: dict[str, set[CodeType]] = {}
    for name in dir(kind):
        if name.startswith("_"):
            continue
        value = inspect.getattr_static(kind, name)
        parts = (value.fget, value.fset) if isinstance(value, property) else (value,)
        functions = [inspect.unwrap(getattr(part, "__func__", part)) for part in parts if part]
        found[name] = {f.__code__ for f in functions if hasattr(f, "__code__")}
    return found


def uncalled_methods(
    kind: type, questions: Iterable[str], actions: Iterable[Callable[[], Any]]
) -> set[str]:
    """Return public names of a class that are no questions, and that no action calls.

    Beside them those of ``questions`` that there are not, with a remark. A property with a setter
    counts as called where the setter was.
    """
    called: set[CodeType] = set()

    def note(frame: FrameType, event: str, argument: Any) -> None:
        if event == "call":
            called.add(frame.f_code)

    before = sys.getprofile()
    for action in actions:
        sys.setprofile(note)
        try:
            action()
        finally:
            sys.setprofile(before)
    codes, asked = _codes_of(kind), set(questions)
    changing = {name for name in codes if name not in asked}
    gone = {f"{name}, which there is not" for name in asked - set(codes)}
    return {name for name in changing if codes[name].isdisjoint(called)} | gone
