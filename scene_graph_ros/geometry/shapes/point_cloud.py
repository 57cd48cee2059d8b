"""Balls around points, as a sensor sees them."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.errors import InvalidShapeError
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.real_arrays import real_array
from scene_graph_ros.geometry.shapes.element_shape import ElementKind, ElementShape
from scene_graph_ros.geometry.tolerances import MAX_COORDINATE, MAX_SHAPE_SIZE

__all__ = ["PointCloud", "checked_points", "checked_radii"]

FloatArray = NDArray[np.float64]


class PointCloud(ElementShape):
    """The union of closed balls about points ``(n, 3)`` in G, in m; n may be 0.

    ``radius`` (m, at least 0) is that of all balls, or ``(n,)`` one each: how far from a point a
    surface may be that the sensor saw there, half its resolution at least. With radius 0 they are
    points. `Context.set_points` says which points there are now.
    """

    __slots__ = ("_points", "_radii", "begun")
    kind: ClassVar[ElementKind] = ElementKind.POINT_CLOUD  # type: ignore[assignment]

    def __init__(self, points: ArrayLike, radius: ArrayLike) -> None:
        """Copy points and radii.

        Raises InvalidShapeError for an array of another shape or type, and, naming its index, for
        a point that is not finite or beyond MAX_COORDINATE, or a radius out of range.
        """
        self._points = checked_points(points, "PointCloud: points", InvalidShapeError)
        self._radii = checked_radii(
            radius, len(self._points), "PointCloud: radius", InvalidShapeError, may_be_one=True
        )
        self.begun: object | None = None
        """The model's points of it before any were set, with their tree."""

    @property
    def points(self) -> FloatArray:
        """The points to begin with, ``(n, 3)`` in G, in m, read-only."""
        return self._points

    @property
    def radius(self) -> float | FloatArray:
        """The radius of all balls, m, or ``(n,)`` one each, read-only."""
        return self._radii if self.has_radii else float(self._radii)

    @property
    def has_radii(self) -> bool:
        """Whether each ball has a radius of its own."""
        return self._radii.ndim == 1

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, PointCloud):
            return NotImplemented
        return np.array_equal(self._points, other._points) and np.array_equal(
            self._radii, other._radii
        )

    def __hash__(self) -> int:
        return hash((PointCloud, self._points.tobytes(), self._radii.tobytes()))

    def __repr__(self) -> str:
        n = len(self._points)
        radius = f"{n} radii" if self.has_radii else f"radius={self.radius:g}"
        return f"PointCloud({n} point{'' if n == 1 else 's'}, {radius})"

    def __reduce__(self) -> tuple[Any, ...]:
        return PointCloud, (self._points, self.radius)


def checked_points(value: Any, label: str, error: type[Exception]) -> FloatArray:
    """Return points ``(n, 3)``, copied and read-only; raises ``error`` as PointCloud does."""
    points = real_array(value, f"{label} must be numbers", error)
    if points.size == 0 and points.ndim == 1:
        points = points.reshape(0, 3)  # an empty list
    if points.ndim != 2 or points.shape[1] != 3:
        raise error(f"{label} must be (n, 3), not {points.shape}")
    if not (len(points) == 0 or np.abs(points).max() <= MAX_COORDINATE):  # NaN is not, either
        row = int((~(np.abs(points) <= MAX_COORDINATE).all(axis=1)).argmax())
        raise error(
            f"{label}: point {row} must be finite and within {MAX_COORDINATE:g} m of the origin,"
            f" not {points[row].tolist()}"
        )
    points.setflags(write=False)
    return points


def checked_radii(
    value: Any, count: int, label: str, error: type[Exception], *, may_be_one: bool
) -> FloatArray:
    """Return radii ``(count,)``, or ``()`` if one may stand for all; copied and read-only."""
    radii = real_array(value, f"{label} must be numbers", error)
    if radii.shape != (count,) and not (may_be_one and radii.ndim == 0):
        one = "a number or " if may_be_one else ""
        raise error(f"{label} must be {one}({count},), one for each point, not {radii.shape}")
    is_right = (radii >= 0.0) & (radii <= MAX_SHAPE_SIZE)
    if not is_right.all():
        at = "" if radii.ndim == 0 else f" of point {int((~is_right).argmax())}"
        bad = radii.reshape(-1)[int((~is_right.reshape(-1)).argmax())]
        raise error(
            f"{label}{at} must be finite, from 0 to {MAX_SHAPE_SIZE:g} m, not {quoted(bad.item())}"
        )
    radii.setflags(write=False)
    return radii
