"""All sums of points of several sets."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

from scene_graph_ros.convex.questions.answers import Support
from scene_graph_ros.convex.questions.pieces import Piece
from scene_graph_ros.convex.sets.convex_set import ConvexSet
from scene_graph_ros.convex.sets.from_shapes import (
    capsule_of,
    is_query,
    placed_shape,
)
from scene_graph_ros.convex.sets.hyperellipsoid import Hyperellipsoid
from scene_graph_ros.convex.sets.members import as_members, common_dimension, member
from scene_graph_ros.convex.sets.reach_of_members import ReachOfMembers
from scene_graph_ros.convex.sets.v_polytope import VPolytope
from scene_graph_ros.convex.solve.cones.lift import equations, joined, Lift
from scene_graph_ros.convex.solve.exact.corners import Corners, Sum
from scene_graph_ros.geometry.model.ids import FrameId, GeometryId
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = ["MinkowskiSum"]


def _by_other_variables(lift: Lift, n: int) -> tuple[np.ndarray, Lift]:
    """Return the matrix ``(n, v)`` from variables to points of a set, and the variables' lift."""
    own = np.arange(lift.num_variables) < n
    is_given = (
        len(lift.E) >= n
        and not lift.cones
        and not lift.f[:n].any()
        and (lift.E[:n, own] == np.eye(n)).all()
        and not lift.E[n:, own].any()
        and not lift.A[:, own].any()
    )
    if not is_given:
        return np.eye(n, lift.num_variables), lift
    rest = Lift(lift.E[n:, ~own], lift.f[n:], lift.A[:, ~own], lift.b)
    return -lift.E[:n, ~own], rest


class MinkowskiSum(ConvexSet):
    """All ``x_1 + x_2 + ...`` of points of ``sets``, or of two sets; {0} without any.

    ``MinkowskiSum(query, geometry_id, reference_frame=None)`` is a registered capsule: a ball and
    a segment.
    """

    _HAS_QUICK_SUPPORT = True

    def __init__(
        self,
        sets: Any = (),
        other: ConvexSet | GeometryId | None = None,
        reference_frame: FrameId | None = None,
    ) -> None:
        """Take sets of one dimension, or a geometry. Raises ConvexSetError."""
        if is_query(sets):
            radius, ends = capsule_of(*placed_shape(sets, other, reference_frame), "MinkowskiSum")  # type: ignore[arg-type]
            ball = Hyperellipsoid.make_hypersphere(radius, np.zeros(3))
            self._terms: tuple[ConvexSet, ...] = (ball, VPolytope(ends))
        else:
            self._terms = as_members(sets, other, "MinkowskiSum")  # type: ignore[arg-type]
        super().__init__(common_dimension(self._terms, "MinkowskiSum"))

    def num_terms(self) -> int:
        """Return the number of summed sets."""
        return len(self._terms)

    def term(self, index: int) -> ConvexSet:
        """Return one of them. Raises ConvexSetError for a number without one."""
        return member(self._terms, index, "MinkowskiSum.term")

    def maybe_get_point(self) -> np.ndarray | None:
        """Return the sum of the terms where each is a point; 0 without any."""
        found = [term.maybe_get_point() for term in self._terms]
        parts = [each for each in found if each is not None]
        if len(parts) < len(found):
            return super().maybe_get_point()
        return np.sum(parts, axis=0) if parts else np.zeros(self.ambient_dimension)

    @functools.cached_property
    def corners(self) -> Corners | None:
        """The sum of the corners of the terms, where all have them."""
        found = [term.corners for term in self._terms]
        known = [each for each in found if each is not None]
        return Sum(known) if found and len(known) == len(found) else None

    @functools.cached_property
    def _reaches(self) -> ReachOfMembers:
        return ReachOfMembers(self._terms, self.ambient_dimension)

    def _is_quickly_empty(self) -> bool:
        return any(term.is_empty() for term in self._terms)

    def _is_quickly_bounded(self) -> bool:
        return self.is_empty() or all(term.is_bounded() for term in self._terms)

    def maybe_get_feasible_point(self) -> np.ndarray | None:
        """Return the sum ``(n,)`` of points of the sets, rounded; None if one has none."""
        total = np.zeros(self.ambient_dimension)
        for term in self._terms:
            point = term.maybe_get_feasible_point()
            if point is None:
                return None
            total += point
        return total

    def lift(self) -> Lift:
        """Return ``x - x_1 - x_2 - ... = 0`` and the rows of each.

        Where a term's equations give x_k by its other variables, as weights of points do, these
        stand for it.
        """
        n = self.ambient_dimension
        parts = [_by_other_variables(term.lift(), n) for term in self._terms]
        total = n + sum(lift.num_variables for _, lift in parts)
        E = np.zeros((n, total))
        E[:, :n] = np.eye(n)
        placed, first = [], n
        for map_, lift in parts:
            E[:, first : first + map_.shape[1]] = -map_
            placed.append(lift.placed(np.arange(first, first + lift.num_variables), total))
            first += lift.num_variables
        return joined([equations(E, np.zeros(n)), *placed])

    def _support(self, d: np.ndarray) -> Support:
        values, points, gaps = self._reaches.along(d)
        endless = np.flatnonzero(values == np.inf)
        if len(endless):
            return Support(np.inf, points[endless[0]], 0.0)
        rounding = len(values) * EPSILON * float(np.abs(values).sum())
        return Support(float(values.sum()), points.sum(axis=0), float(gaps.sum()) + rounding)

    def _inner_reach(self, d: np.ndarray) -> tuple[np.ndarray, float] | None:
        points, moved = self._reaches.inner(d)
        if np.isnan(points).any():
            return None
        rounding = len(points) * EPSILON * float(np.abs(points).sum(axis=0).max())
        return points.sum(axis=0), float(moved.sum()) + rounding

    def _pieces(self, d: np.ndarray, within: float) -> list[Piece] | None:
        return self._reaches.piece_of_sum(d) if self._terms else None

    def _outside(self, points: np.ndarray) -> np.ndarray:
        found = self.projection(points)
        return np.full(len(points), np.inf) if found is None else found.distances
