"""Light and the numbers that sRGB writes for it (IEC 61966-2-1)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["linear", "srgb"]


def linear(levels: Any) -> NDArray[np.float64]:
    """Return light, 0 to 1, of numbers as sRGB writes them, 0 to 1."""
    c = np.asarray(levels, np.float64)
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


def srgb(light: Any) -> NDArray[np.float64]:
    """Return numbers as sRGB writes them, 0 to 1, of light, which is cut off at 1."""
    c = np.clip(np.asarray(light, np.float64), 0.0, 1.0)
    return np.where(c <= 0.0031308, 12.92 * c, 1.055 * c ** (1.0 / 2.4) - 0.055)
