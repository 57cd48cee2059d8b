"""The intersection of several sets."""

from __future__ import annotations

from typing import Any

import numpy as np

from scene_graph_ros.convex.sets.convex_set import ConvexSet
from scene_graph_ros.convex.sets.members import as_members, common_dimension, member
from scene_graph_ros.convex.solve.cones.lift import Lift, shared_point

__all__ = ["Intersection"]


class Intersection(ConvexSet):
    """All points that are in each of ``sets``, or in both of two; {0} without any."""

    def __init__(self, sets: Any = (), other: ConvexSet | None = None) -> None:
        """Take sets of one dimension. Raises ConvexSetError."""
        self._elements = as_members(sets, other, "Intersection")
        super().__init__(common_dimension(self._elements, "Intersection"))

    def num_elements(self) -> int:
        """Return the number of sets."""
        return len(self._elements)

    def element(self, index: int) -> ConvexSet:
        """Return one of them. Raises ConvexSetError for a number without one."""
        return member(self._elements, index, "Intersection.element")

    def maybe_get_point(self) -> np.ndarray | None:
        """Return the point that all elements are, if each is one and they are equal."""
        found = [each.maybe_get_point() for each in self._elements]
        points = [each for each in found if each is not None]
        if not found or len(points) < len(found):
            return super().maybe_get_point()
        return points[0] if all(np.array_equal(each, points[0]) for each in points) else None

    def lift(self) -> Lift:
        """Return the rows of all, with one point."""
        return shared_point([each.lift() for each in self._elements], self.ambient_dimension)

    def _outside(self, points: np.ndarray) -> np.ndarray:
        each = [element._outside(points) for element in self._elements]
        return np.max(each, axis=0, initial=0.0) if each else np.zeros(len(points))

    def _are_near(self, points: np.ndarray, tol: float) -> np.ndarray:
        near = np.ones(len(points), dtype=np.bool_)
        for element in self._elements:
            near[near] = element._are_near(points[near], tol)
        # What is near each may be far from all, next to where their surfaces meet.
        rows = np.flatnonzero(near)
        unsure = rows[self._outside(points[rows]) > 0.0]
        if len(unsure):
            near[unsure] = self._are_near_by_projection(points[unsure], tol)
        return near
