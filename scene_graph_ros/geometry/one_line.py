"""How objects show themselves: in one line, without addresses and without walls of numbers."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
import dataclasses
import enum
import math
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

__all__ = ["LONGEST", "cut", "one_line"]

LONGEST = 200
"""Characters of a ``repr``."""
_LONGEST_PART = 60
_FEW = 4
"""Numbers of an array, or entries of a collection, that are shown themselves."""

_COLLECTIONS = (list, tuple, set, frozenset)

Class = TypeVar("Class", bound=type[Any])


def one_line(*names: str) -> Callable[[Class], Class]:
    """Have a class show its type and some attributes, as ``Plan(is_success=True, ...)``.

    Without ``names`` those are the fields of a dataclass or a named tuple. Attributes are cheap to
    read; those that raise AttributeError are left out, as in an object that is half made.
    """

    def decorated(shown: Class) -> Class:
        fields = names or _fields(shown)

        def text(self: Any) -> str:
            parts = (f"{name}={_said(getattr(self, name))}" for name in fields if _has(self, name))
            return cut(f"{type(self).__name__}({', '.join(parts)})")

        text.__name__, text.__qualname__ = "__repr__", f"{shown.__qualname__}.__repr__"
        text.__module__ = __name__
        shown.__repr__ = text  # type: ignore[assignment]
        return shown

    return decorated


def cut(text: str, longest: int = LONGEST) -> str:
    """Return the text in one line, without its middle where it is longer than ``longest``."""
    flat = " ".join(text.split())
    if len(flat) <= longest:
        return flat
    end = flat[-1] if flat[-1] in ")>]" else ""
    return f"{flat[: longest - 3 - len(end)]}...{end}"


def _has(holder: object, name: str) -> bool:
    try:
        getattr(holder, name)
    except AttributeError:
        return False
    return True


def _fields(shown: type[Any]) -> tuple[str, ...]:
    if dataclasses.is_dataclass(shown):
        return tuple(field.name for field in dataclasses.fields(shown) if field.repr)
    fields: tuple[str, ...] = getattr(shown, "_fields", ())
    return fields


def _said(value: Any) -> str:
    """Return a value in a few words."""
    if isinstance(value, enum.Enum):
        return value.name
    if value is None or isinstance(value, (bool, int, float, np.generic)):
        return _number(value)
    if isinstance(value, (str, Path)):
        return cut(repr(str(value)), _LONGEST_PART)
    if isinstance(value, np.ndarray):
        return _array(value)
    if type(value) in _COLLECTIONS or isinstance(value, Mapping):
        return _collection(value)
    own: Any = type(value).__repr__
    if own is object.__repr__:
        return _name(value)
    text = repr(value)
    return text if _is_short(text) else type(value).__name__


def _name(value: Any) -> str:
    name: str = getattr(value, "__name__", type(value).__name__)
    return name


def _number(value: Any) -> str:
    number = value.item() if isinstance(value, np.generic) else value
    if isinstance(number, float) and math.isfinite(number):
        return f"{number + 0.0:.6g}"
    return cut(str(number), _LONGEST_PART)


def _array(value: np.ndarray[Any, Any]) -> str:
    if value.ndim == 1 and value.size <= _FEW and value.dtype.kind in "biuf":
        return f"[{', '.join(map(_number, value))}]"
    return f"{value.shape} array"


def _collection(value: Collection[Any]) -> str:
    if len(value) <= _FEW and not isinstance(value, Mapping):
        text = f"[{', '.join(map(_said, value))}]"
        if _is_short(text):
            return text
    return f"{len(value)} entries" if len(value) != 1 else "1 entry"


def _is_short(text: str) -> bool:
    return len(text) <= _LONGEST_PART and "\n" not in text and " at 0x" not in text
