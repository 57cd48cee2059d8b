"""How much memory a message takes, about."""

from __future__ import annotations

from array import array
from functools import cache
from typing import Any

import numpy as np

__all__ = ["size_of"]

_SCALAR = 8
"""Bytes that a number or an element of a list counts as, besides what it holds."""


def size_of(value: Any) -> int:
    """Return about how many bytes a message, or a field of one, takes.

    Texts and arrays count as their contents, which can be large.
    """
    if isinstance(value, (array, np.ndarray)):
        return _SCALAR + len(value) * value.itemsize
    if isinstance(value, (str, bytes)):
        return _SCALAR + len(value)
    if isinstance(value, (list, tuple)):
        return _SCALAR + sum(map(size_of, value))
    if hasattr(value, "get_fields_and_field_types"):
        kind: Any = type(value)
        return _SCALAR + sum(size_of(getattr(value, field)) for field in _fields(kind))
    return _SCALAR


@cache
def _fields(kind: Any) -> tuple[str, ...]:
    """Return the fields of a kind of message that can be large."""
    types = kind.get_fields_and_field_types()
    message = kind()
    return tuple(name for name, text in types.items() if _can_grow(text, getattr(message, name)))


def _can_grow(text: str, value: Any) -> bool:
    if hasattr(value, "get_fields_and_field_types"):
        kind: Any = type(value)
        return bool(_fields(kind))
    return "sequence" in text or "string" in text
