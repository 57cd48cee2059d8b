"""The error of a message of a page that is none, and the values that are looked at for it."""

from __future__ import annotations

import math

from scene_graph_ros.geometry.quoting import quoted

__all__ = ["WishError", "name_of", "number_of"]


class WishError(ValueError):
    """A message of a page that is none."""


def number_of(value: object, field: str) -> float:
    """Return a finite number. Raises WishError naming the field and its value."""
    if not isinstance(value, (int, float)) or isinstance(value, bool):
        raise WishError(f"{field} is no finite number: {quoted(value)}")
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise WishError(f"{field} is no finite number: {quoted(value)}")
    return number


def name_of(value: object, field: str) -> str:
    """Return a name. Raises WishError naming the field and its value."""
    if not isinstance(value, str):
        raise WishError(f"{field} is no name: {quoted(value)}")
    return value
