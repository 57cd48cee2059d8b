"""Checks of renderers' parameters: each is quoted with its class and name where it is refused."""

from __future__ import annotations

import math
import numbers
from typing import Any

from scene_graph_ros.geometry.errors import EngineError
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.reals import as_float

__all__ = ["checked_number", "checked_vector", "checked_whole"]


def checked_number(owner: object, name: str, least: float, most: float) -> float:
    """Return a field that is a number from ``least`` to ``most``. Raises EngineError."""
    value = getattr(owner, name)
    number = as_float(value)
    if number is None or not least <= number <= most:
        raise EngineError(
            f"{type(owner).__name__}: {name} must be a number from {least:g} to {most:g}, not"
            f" {quoted(value)}"
        )
    return number


def checked_whole(owner: object, name: str, least: int, most: int) -> int:
    """Return a field that is a whole number from ``least`` to ``most``. Raises EngineError."""
    value = getattr(owner, name)
    is_whole = isinstance(value, numbers.Integral) and not isinstance(value, bool)
    if not is_whole or not least <= value <= most:
        raise EngineError(
            f"{type(owner).__name__}: {name} must be a whole number from {least} to {most}, not"
            f" {quoted(value)}"
        )
    return int(value)


def checked_vector(
    owner: object, name: str, most: float, *, is_direction: bool = False
) -> tuple[float, float, float]:
    """Return a field that is three numbers of at most ``most`` each, not all 0 for a direction."""
    value: Any = getattr(owner, name)
    try:
        entries = [as_float(entry) for entry in value]
    except TypeError:
        entries = []
    known = [e for e in entries if e is not None and math.isfinite(e) and abs(e) <= most]
    if len(known) != 3 or len(entries) != 3 or (is_direction and not any(known)):
        what = "three numbers, not all 0," if is_direction else "three numbers"
        raise EngineError(
            f"{type(owner).__name__}: {name} must be {what} of at most {most:g}, not"
            f" {quoted(value)}"
        )
    return (known[0], known[1], known[2])
