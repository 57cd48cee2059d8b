"""The heights of a field, at one moment."""

from __future__ import annotations

import threading
from typing import Any, TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import InvalidConfigurationError
from scene_graph_ros.geometry.shapes.height_field import checked_heights, HeightField

if TYPE_CHECKING:
    from scene_graph_ros.geometry.tables.height_grid import PlacedHeights

__all__ = ["HeightSet", "initial_heights", "new_heights"]

FloatArray = NDArray[np.float64]


class HeightSet:
    """Heights that never change. What kernels read of them is made when it is first asked for.

    From then on that has the heights, and nobody else.
    """

    __slots__ = ("__weakref__", "_given", "_lock", "_placed", "shape")

    def __init__(self, shape: HeightField, heights: FloatArray) -> None:
        """Take heights ``(rows, cols)`` that nobody writes to."""
        self.shape = shape
        """The shape whose heights they are."""
        self._given: FloatArray | None = heights
        self._placed: PlacedHeights | None = None
        self._lock = threading.RLock()  # A thread that is interrupted may come once more.

    @property
    def heights(self) -> FloatArray:
        """The heights ``(rows, cols)`` above G's xy plane, in m, read-only."""
        given = self._given
        if given is None:
            assert self._placed is not None
            given = self._placed.heights()
            given.setflags(write=False)
        return given

    @property
    def placed(self) -> PlacedHeights:
        """The heights for kernels. Any thread may ask."""
        if self._placed is None:
            from scene_graph_ros.geometry.tables.height_grid import place_heights

            with self._lock:
                if self._placed is None:
                    assert self._given is not None
                    self._placed = place_heights(self._given, self.shape.size, self.shape.floor)
                    self._given = None
        return self._placed


def initial_heights(shape: HeightField) -> HeightSet:
    """Return the heights that a shape begins with, the same object each time."""
    begun = shape.begun
    if begun is None:
        begun = shape.begun = HeightSet(shape, shape.heights)
    assert isinstance(begun, HeightSet)
    return begun


def new_heights(shape: HeightField, value: Any, label: str) -> HeightSet:
    """Return heights that were set, copied; ``value`` as `Context.set_heights` takes it.

    Heights of the same shape that never change, such as those of another context, are taken as
    they are. Raises InvalidConfigurationError, which begins with ``label``.
    """
    if isinstance(value, HeightSet) and value.shape is shape:
        return value
    error = InvalidConfigurationError
    heights = checked_heights(value, shape.floor, f"{label}: heights", error)
    if heights.shape != shape.heights.shape:
        raise error(
            f"{label}: heights must be {shape.heights.shape}, as it was registered with, not"
            f" {heights.shape}"
        )
    return HeightSet(shape, heights)
