"""The points of a cloud, at one moment."""

from __future__ import annotations

import threading
from typing import Any, TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import InvalidConfigurationError
from scene_graph_ros.geometry.shapes.point_cloud import checked_points, checked_radii, PointCloud

if TYPE_CHECKING:
    from scene_graph_ros.geometry.tables.point_tree import PlacedPoints

__all__ = ["PointSet", "initial_points", "new_points"]

FloatArray = NDArray[np.float64]


class PointSet:
    """Points with radii that never change. Their tree is built when it is first asked for.

    From then on the tree has the points, and nobody else: a million of them take 36 MB.
    """

    __slots__ = ("_given", "_lock", "_placed", "count", "radii", "shape")

    def __init__(self, shape: PointCloud, points: FloatArray, radii: FloatArray) -> None:
        """Take points ``(n, 3)`` and radii ``(n,)``, or ``()``, that nobody writes to."""
        self.shape = shape
        """The shape whose points they are."""
        self.count = len(points)
        self.radii = radii
        """``(n,)`` or, of all alike, ``()``; in m."""
        self._given: FloatArray | None = points
        self._placed: PlacedPoints | None = None
        self._lock = threading.RLock()  # A thread that is interrupted may come once more.

    @property
    def points(self) -> FloatArray:
        """The points ``(n, 3)`` in G, in m, in their order, read-only."""
        given = self._given
        if given is None:
            assert self._placed is not None
            given = self._placed.points_in_order()
            given.setflags(write=False)
        return given

    @property
    def placed(self) -> PlacedPoints:
        """The points in their tree, for kernels. Any thread may ask."""
        if self._placed is None:
            from scene_graph_ros.geometry.tables.point_tree import place_points

            with self._lock:
                if self._placed is None:
                    assert self._given is not None
                    self._placed = place_points(self._given, self.radii)
                    self._given = None
        return self._placed


def initial_points(shape: PointCloud) -> PointSet:
    """Return the points that a shape begins with, the same object each time."""
    begun = shape.begun
    if begun is None:
        begun = shape.begun = PointSet(shape, shape.points, np.asarray(shape.radius))
    assert isinstance(begun, PointSet)
    return begun


def new_points(shape: PointCloud, value: Any, label: str) -> PointSet:
    """Return points that were set, copied; ``value`` as `Context.set_points` takes it.

    Points of the same shape that never change, such as those of another context, are taken as they
    are, with their tree. Raises InvalidConfigurationError, which begins with ``label``.
    """
    if isinstance(value, PointSet) and value.shape is shape:
        return value
    error = InvalidConfigurationError
    given, radii = value if _is_pair(value) else (value, None)
    points = checked_points(given, f"{label}: points", error)
    if radii is not None:
        radii = checked_radii(radii, len(points), f"{label}: radii", error, may_be_one=False)
        return PointSet(shape, points, radii)
    if shape.has_radii:
        raise error(
            f"{label}: its points have a radius each, so set (points, radii), or register it"
            " with one radius for all"
        )
    return PointSet(shape, points, np.asarray(shape.radius))


def _is_pair(value: Any) -> bool:
    """Tell whether a value is points and radii; two points in a tuple have one axis each."""
    if not isinstance(value, tuple) or len(value) != 2:
        return False
    try:
        return np.ndim(value[0]) == 2 or np.size(value[0]) == 0
    except ValueError:  # a ragged list, which is no array of points either
        return False
