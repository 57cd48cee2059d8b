"""A grid of heights, solid below: terrain, a floor that a robot mapped, a heap."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.errors import InvalidShapeError
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.real_arrays import real_array
from scene_graph_ros.geometry.reals import as_float
from scene_graph_ros.geometry.shapes.element_shape import ElementKind, ElementShape
from scene_graph_ros.geometry.tolerances import MAX_SHAPE_SIZE, MIN_SHAPE_SIZE

__all__ = ["HeightField", "checked_heights"]

FloatArray = NDArray[np.float64]


class HeightField(ElementShape):
    """The solid between a grid of heights and a floor, in G, z up; lengths in m.

    ``heights[i, j]`` is the height above the xy plane at ``x = (j / (cols - 1) - 1/2) size[0]``
    and ``y = (i / (rows - 1) - 1/2) size[1]``. The surface of a cell is two triangles along the
    diagonal from ``(i, j)`` to ``(i + 1, j + 1)``. Below them it is solid down to ``z = floor``.
    Its elements are the prisms below the triangles: prism ``2 (i (cols - 1) + j)`` is that of
    ``(i, j)``, ``(i, j + 1)`` and ``(i + 1, j + 1)``, the next one that of ``(i, j)``,
    ``(i + 1, j + 1)`` and ``(i + 1, j)``. `Context.set_heights` says which heights there are now.
    """

    __slots__ = ("_floor", "_heights", "_size", "begun")
    kind: ClassVar[ElementKind] = ElementKind.HEIGHT_FIELD  # type: ignore[assignment]

    def __init__(self, heights: ArrayLike, size: ArrayLike, floor: float) -> None:
        """Copy heights ``(rows, cols)``, at least two of each.

        Raises InvalidShapeError for arrays of another shape or type, for a size or a floor that is
        none, and, naming its index, for a height that is not finite or not above the floor.
        """
        error = InvalidShapeError
        lengths = real_array(size, "HeightField: size must be two numbers", error)
        if lengths.shape != (2,):
            raise error(
                "HeightField: size must be two numbers, the lengths along x and y, not"
                f" {lengths.shape}"
            )
        bottom = as_float(floor)
        if bottom is None or not abs(bottom) <= MAX_SHAPE_SIZE:
            raise error(
                f"HeightField: floor must be a number within {MAX_SHAPE_SIZE:g} m of 0, not"
                f" {quoted(floor)}"
            )
        self._floor = bottom
        self._heights = checked_heights(heights, bottom, "HeightField: heights", error)
        cells = np.array(self._heights.shape[::-1]) - 1
        edges = lengths / cells
        if not ((edges >= MIN_SHAPE_SIZE) & (lengths <= MAX_SHAPE_SIZE)).all():
            axis = int((~((edges >= MIN_SHAPE_SIZE) & (lengths <= MAX_SHAPE_SIZE))).argmax())
            raise error(
                f"HeightField: size along {'xy'[axis]} must be from {MIN_SHAPE_SIZE:g} m for each"
                f" of its {cells[axis]} cells to {MAX_SHAPE_SIZE:g} m, not"
                f" {quoted(lengths[axis].item())}"
            )
        self._size = (float(lengths[0]), float(lengths[1]))
        self.begun: object | None = None
        """The model's heights of it before any were set."""

    @property
    def heights(self) -> FloatArray:
        """The heights to begin with, ``(rows, cols)`` in m, read-only."""
        return self._heights

    @property
    def size(self) -> tuple[float, float]:
        """The lengths along x and y, m."""
        return self._size

    @property
    def floor(self) -> float:
        """The z of its underside, m."""
        return self._floor

    @property
    def num_elements(self) -> int:
        """How many prisms it is of."""
        rows, cols = self._heights.shape
        return 2 * (rows - 1) * (cols - 1)

    def x(self) -> FloatArray:
        """Return the x of each column of heights, ``(cols,)`` in G, in m."""
        return _along(self._heights.shape[1], self._size[0])

    def y(self) -> FloatArray:
        """Return the y of each row of heights, ``(rows,)`` in G, in m."""
        return _along(self._heights.shape[0], self._size[1])

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, HeightField):
            return NotImplemented
        return (self._size, self._floor) == (other._size, other._floor) and np.array_equal(
            self._heights, other._heights
        )

    def __hash__(self) -> int:
        return hash((HeightField, self._size, self._floor, self._heights.tobytes()))

    def __repr__(self) -> str:
        rows, cols = self._heights.shape
        (width, depth) = self._size
        return f"HeightField({rows}x{cols}, size=({width:g}, {depth:g}), floor={self._floor:g})"

    def __reduce__(self) -> tuple[Any, ...]:
        return HeightField, (self._heights, self._size, self._floor)


def _along(count: int, length: float) -> FloatArray:
    result: FloatArray = (np.arange(count) / (count - 1) - 0.5) * length
    return result


def checked_heights(value: Any, floor: float, label: str, error: type[Exception]) -> FloatArray:
    """Return heights ``(rows, cols)``, copied and read-only; raises as HeightField does."""
    heights = real_array(value, f"{label} must be numbers", error)
    if heights.ndim != 2 or min(heights.shape) < 2:
        raise error(f"{label} must be (rows, cols), at least two of each, not {heights.shape}")
    least = floor + MIN_SHAPE_SIZE
    is_right = (heights >= least) & (heights <= floor + MAX_SHAPE_SIZE)  # NaN is not, either
    if not is_right.all():
        i, j = np.unravel_index(int((~is_right).argmax()), heights.shape)
        bad = float(heights[i, j])
        if np.isfinite(bad) and bad < least:
            raise error(
                f"{label}[{i}, {j}] must lie above the floor at {floor:g} m, by {MIN_SHAPE_SIZE:g}"
                f" m at least, not at {bad:g} m"
            )
        raise error(
            f"{label}[{i}, {j}] must be finite and within {MAX_SHAPE_SIZE:g} m of the floor, not"
            f" {bad}"
        )
    heights.setflags(write=False)
    return heights
