"""A set of exactly one point."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.convex.questions.answers import Projection, Support
from scene_graph_ros.convex.questions.arguments import as_nonnegative, as_vector
from scene_graph_ros.convex.sets.convex_set import ConvexSet
from scene_graph_ros.convex.sets.from_shapes import is_query, placed_shape
from scene_graph_ros.convex.solve.cones.lift import Lift
from scene_graph_ros.convex.solve.exact.corners import Points
from scene_graph_ros.geometry.model.ids import FrameId, GeometryId
from scene_graph_ros.geometry.shapes.shape import Shape
from scene_graph_ros.geometry.shapes.sphere import Sphere
from scene_graph_ros.geometry.spatial.sums import product

__all__ = ["Point"]


class Point(ConvexSet):
    """The point ``x (n,)``; without arguments {0} in no dimensions.

    ``Point(query, geometry_id, reference_frame=None, maximum_allowable_radius=r)`` is the centre
    of a registered sphere of radius r at most, in a frame, the world by default.
    """

    _IS_NEVER_EMPTY = True
    _IS_ALWAYS_BOUNDED = True

    def __init__(
        self,
        x: Any = (),
        geometry_id: GeometryId | None = None,
        reference_frame: FrameId | None = None,
        *,
        maximum_allowable_radius: float = 0.0,
    ) -> None:
        """Take a vector or a geometry. Raises ConvexSetError unless x is finite."""
        if is_query(x):
            assert geometry_id is not None
            x = _center(*placed_shape(x, geometry_id, reference_frame), maximum_allowable_radius)
        self._x = as_vector(x, "Point: x")
        super().__init__(len(self._x))

    @property
    def x(self) -> np.ndarray:
        """The point ``(n,)``."""
        return self._x

    def lift(self) -> Lift:
        """Return one equation for each coordinate."""
        n = self.ambient_dimension
        return Lift(np.eye(n), self._x, np.zeros((0, n)), np.zeros(0))

    @functools.cached_property
    def corners(self) -> Points:
        """The point alone."""
        return Points(self._x[np.newaxis])

    def maybe_get_point(self) -> np.ndarray | None:
        """Return the point."""
        return self._x

    def _outside(self, points: np.ndarray) -> np.ndarray:
        return np.linalg.norm(points - self._x, axis=1)

    def _support(self, d: np.ndarray) -> Support:
        return Support(float(product(d, self._x)), self._x, 0.0)

    def _inner_reach(self, d: np.ndarray) -> tuple[np.ndarray, float] | None:
        return self._support(d).point, 0.0

    def _project(self, points: np.ndarray) -> Projection:
        return Projection(
            self._outside(points), np.tile(self._x, (len(points), 1)), np.zeros(len(points))
        )

    @property
    def has_exact_volume(self) -> bool:
        """Always: it is 0."""
        return True

    def _volume(self) -> float:
        return 0.0

    def _shape_with_pose(self) -> tuple[Shape, np.ndarray]:
        pose = np.eye(4)
        pose[:3, 3] = self._x
        return Sphere(0.0), pose


def _center(shape: Shape, X_FG: np.ndarray, most: float) -> np.ndarray:
    """Return the centre ``(3,)`` of a sphere that is small enough. Raises ConvexSetError."""
    radius = as_nonnegative(most, "Point: maximum_allowable_radius")
    if not isinstance(shape, Sphere) or shape.radius > radius:
        raise ConvexSetError(
            f"Point: the geometry must be a Sphere of radius at most {radius!r}, not {shape!r};"
            " raise maximum_allowable_radius"
        )
    return X_FG[:3, 3]
