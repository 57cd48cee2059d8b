"""A set of rows ``A x <= b``, with the answers of every convex set."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

from scene_graph_ros.convex.errors import SolverError
from scene_graph_ros.convex.questions.answers import Projection
from scene_graph_ros.convex.questions.arguments import as_matrix, as_vector
from scene_graph_ros.convex.questions.quick_answers import (
    center_of_rows,
    is_row_bounded,
    point_of_rows,
)
from scene_graph_ros.convex.questions.row_geometry import (
    are_boxed,
    are_feet_inside,
    box_of_rows,
    distances_outside,
    nearest_of_rows,
)
from scene_graph_ros.convex.sets.conversions import (
    shape_of_hull,
    vertices_of_polyhedron,
    volume_of,
)
from scene_graph_ros.convex.sets.convex_set import ConvexSet
from scene_graph_ros.convex.solve.cones.lift import Lift
from scene_graph_ros.convex.solve.exact.feasibility import find_deepest
from scene_graph_ros.geometry.shapes.shape import Shape

__all__ = ["RowSet"]

_EXACT_VOLUME_DIMENSIONS = 4
"""Beyond, a polyhedron may have too many vertices to list."""


class RowSet(ConvexSet):
    """All x with ``A x <= b``: ``A (m, n)``, ``b (m,)``. It may be unbounded, flat or empty."""

    def __init__(self, A: Any, b: Any) -> None:
        """Take rows. Raises ConvexSetError unless A and b fit."""
        self._A = as_matrix(A, f"{type(self).__name__}: A")
        self._b = as_vector(b, f"{type(self).__name__}: b", len(self._A))
        super().__init__(self._A.shape[1])

    @property
    def A(self) -> np.ndarray:
        """The rows ``(m, n)``."""
        return self._A

    @property
    def b(self) -> np.ndarray:
        """The right sides ``(m,)``."""
        return self._b

    def _corners(self) -> np.ndarray:
        return vertices_of_polyhedron(self)

    @functools.cached_property
    def _lift(self) -> Lift:
        n = self.ambient_dimension
        return Lift(np.zeros((0, n)), np.zeros(0), self._A, self._b)

    def lift(self) -> Lift:
        """Return the rows themselves."""
        return self._lift

    @functools.cached_property
    def own_box(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Corners ``(n,)`` of a bounded box, exactly; None where rows are not those of one.

        Each is of one coordinate, times a power of two.
        """
        return box_of_rows(self._A, self._b)

    def _linear_rows(self) -> tuple[np.ndarray, np.ndarray]:
        return self._A, self._b

    def _is_quickly_empty(self) -> bool | None:
        return self._quickly_empty

    @functools.cached_property
    def _quick_point(self) -> tuple[bool | None, np.ndarray]:
        return point_of_rows(self._A, self._b)

    @functools.cached_property
    def center_in_floats(self) -> np.ndarray | None:
        """The centre ``(n,)`` of the largest ball inside; None where floats leave it open."""
        return center_of_rows(self._A, self._b) if len(self._b) else None

    def _inner(self, question: str) -> np.ndarray:
        is_empty, x = self._quick_point
        return x if is_empty is False else super()._inner(question)

    @functools.cached_property
    def _quickly_empty(self) -> bool | None:
        empty = self._quick_point[0]
        if empty is None and self.own_box is not None:
            return bool((self.own_box[0] > self.own_box[1]).any())
        return empty

    def _is_quickly_bounded(self) -> bool | None:
        return self._quickly_bounded

    @functools.cached_property
    def _quickly_bounded(self) -> bool | None:
        if is_row_bounded(self._A):
            return True
        return True if are_boxed(self._A) else None

    def _outside(self, points: np.ndarray) -> np.ndarray:
        return distances_outside(self._A, self._b, points)

    def _are_near(self, points: np.ndarray, tol: float) -> np.ndarray:
        outside = self._outside(points)
        near = outside <= tol
        # Next to an edge, or where there is nothing, rows are nearer than the set.
        unsure = np.flatnonzero(near & (outside > 0.0))
        unsure = unsure[~are_feet_inside(self._A, self._b, points[unsure])]
        if len(unsure):
            near[unsure] = self._are_near_by_projection(points[unsure], tol)
        return near

    def _project(self, points: np.ndarray) -> Projection:
        if not self.ambient_dimension:
            return Projection(np.zeros(len(points)), points.copy(), np.zeros(len(points)))
        found = nearest_of_rows(self._lift.rows, points)
        if isinstance(found, Projection):
            return found
        raise SolverError(
            f"{type(self).__name__}.projection: no nearest point to {points[found]} was found; the"
            " set is nearly empty, or reduce_inequalities() has fewer rows"
        )

    @property
    def has_exact_volume(self) -> bool:
        """Up to four dimensions."""
        return self.ambient_dimension <= _EXACT_VOLUME_DIMENSIONS

    def _volume(self) -> float:
        if not self.is_bounded():
            return np.inf if find_deepest(self._lift.rows).radius > 0.0 else 0.0
        return volume_of(self._corners())

    def _shape_with_pose(self) -> tuple[Shape, np.ndarray]:
        return shape_of_hull(self._corners())
