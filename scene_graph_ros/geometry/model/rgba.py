"""Colours."""

from __future__ import annotations

from dataclasses import dataclass
import numbers
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.property_errors import PropertyValueError

__all__ = ["Rgba"]


@one_line()
@dataclass(frozen=True, slots=True)
class Rgba:
    """Red, green, blue and opacity, each between 0 and 1."""

    r: float
    g: float
    b: float
    a: float = 1.0

    def __post_init__(self) -> None:
        for channel in ("r", "g", "b", "a"):
            value = getattr(self, channel)
            is_number = isinstance(value, numbers.Real) and not isinstance(value, bool)
            if not is_number or not 0.0 <= value <= 1.0:
                raise PropertyValueError(f"Rgba: {channel} must be between 0 and 1, not {value!r}")
            object.__setattr__(self, channel, float(value))

    @classmethod
    def from_value(cls, value: Any) -> Rgba:
        """Return the colour of an Rgba or of three or four numbers."""
        if isinstance(value, cls):
            return value
        if isinstance(value, (str, bytes)):
            raise PropertyValueError(f"Rgba: not three or four numbers: {value!r}")
        try:
            channels = [float(channel) for channel in value]
        except (TypeError, ValueError) as error:
            raise PropertyValueError(f"Rgba: not three or four numbers: {value!r}") from error
        if len(channels) not in (3, 4):
            raise PropertyValueError(f"Rgba: not three or four numbers: {value!r}")
        return cls(*channels)

    def as_array(self) -> NDArray[np.float64]:
        """Return ``(4,)`` r, g, b, a."""
        return np.array((self.r, self.g, self.b, self.a))
