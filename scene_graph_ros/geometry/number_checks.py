"""Checks of numbers that packages share, each with an error class of its own."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.real_arrays import real_array
from scene_graph_ros.geometry.reals import as_float

__all__ = ["bounds", "nonnegative", "positive", "whole"]


def positive(name: str, value: Any, error: type[Exception]) -> float:
    """Return a positive, finite number. Raises ``error``, which names argument and value."""
    number = as_float(value)
    if number is None or not 0.0 < number < np.inf:
        raise error(f"{name} must be positive and finite, not {quoted(value)}")
    return number


def nonnegative(name: str, value: Any, error: type[Exception]) -> float:
    """Return a finite number from 0 on. Raises ``error``, which names argument and value."""
    number = as_float(value)
    if number is None or not 0.0 <= number < np.inf:
        raise error(f"{name} must be finite and not negative, not {quoted(value)}")
    return number


def whole(name: str, value: Any, error: type[Exception], least: int = 0) -> int:
    """Return a whole number, also of a float, from ``least`` on. Raises ``error``."""
    number = as_float(value)
    if number is None or number < least or not number.is_integer():
        raise error(f"{name} must be a whole number from {least} on, not {quoted(value)}")
    return int(number)


def bounds(
    lb: Any, ub: Any, size: int, error: type[Exception], *, label: str = "", is_broad: bool = False
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return bounds ``(size,)``; infinite ones don't bound. With ``is_broad`` also of one number.

    Raises ``error``, which begins with ``label``, for another shape, NaN, a lower bound of inf, an
    upper one of -inf, and a lower one above the upper.
    """
    found = []
    for name, value, forbidden in (("lb", lb, np.inf), ("ub", ub, -np.inf)):
        array = real_array(value, f"{label}{name} must be numbers", error)
        if is_broad and array.ndim == 0:
            array = np.full(size, array)
        if array.shape != (size,):
            raise error(f"{label}{name} must have the shape ({size},), not {array.shape}")
        bad = np.isnan(array) | (array == forbidden)
        if bad.any():
            k = int(np.argmax(bad))
            raise error(f"{label}{name}[{k}] must bound something, not {array[k]}")
        found.append(array)
    low, high = found
    if (low > high).any():
        k = int(np.argmax(low > high))
        raise error(f"{label}lb[{k}] = {low[k]} must not be above ub[{k}] = {high[k]}")
    return low, high
