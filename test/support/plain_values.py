"""Answers as plain values, so that two of them can be compared with ``==``."""

from __future__ import annotations

from collections.abc import Mapping
import enum
from typing import Any

import numpy as np

__all__ = ["plain"]


def plain(value: Any) -> Any:
    """Return lists, numbers and words that say all that a value has in its public attributes."""
    if value is None or isinstance(value, str | bytes | bool | int | float | enum.Enum):
        return value
    if isinstance(value, np.ndarray | np.generic):
        return repr(value.tolist())  # NaN equals NaN so
    if isinstance(value, Mapping):
        return [(repr(key), plain(each)) for key, each in value.items()]
    if isinstance(value, set | frozenset):
        return sorted(map(repr, value))
    if isinstance(value, list | tuple):
        return [plain(each) for each in value]
    names = [name for name in dir(value) if not name.startswith("_")]
    found = {name: getattr(value, name) for name in names}
    said = [(name, plain(each)) for name, each in found.items() if not callable(each)]
    return said or repr(value)
