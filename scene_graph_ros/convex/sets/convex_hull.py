"""The convex hull of several sets."""

from __future__ import annotations

from collections.abc import Callable
import functools
from typing import Any

import numpy as np

from scene_graph_ros.convex.questions.answers import Support
from scene_graph_ros.convex.questions.pieces import Piece
from scene_graph_ros.convex.questions.surrounding import DRAWN_IN
from scene_graph_ros.convex.sets.convex_set import ConvexSet
from scene_graph_ros.convex.sets.members import as_members, common_dimension, member
from scene_graph_ros.convex.sets.pairwise_intersections import own_box
from scene_graph_ros.convex.sets.reach_of_members import ReachOfMembers
from scene_graph_ros.convex.sets.v_polytope import VPolytope
from scene_graph_ros.convex.solve.cones.lift import Ball, equations, joined, Lift
from scene_graph_ros.convex.solve.exact.corners import Corners, Hull
from scene_graph_ros.geometry.spatial.sums import product

__all__ = ["ConvexHull"]

_FEW_MEMBERS = 8
"""Of so many the rows of each are few, and programs over cones are better posed than of points."""

_MOST_BOX_DIMENSIONS = 4
"""A box's corners are twice as many with each dimension, its rows two more."""


class ConvexHull(ConvexSet):
    """The smallest convex set that holds all ``sets``; of unbounded ones, closed. Empty of none.

    Empty sets don't take part; with ``remove_empty_sets=False`` that is not looked at, and the
    caller answers for it.
    """

    _HAS_QUICK_SUPPORT = True

    def __init__(self, sets: Any, remove_empty_sets: bool = True) -> None:
        """Take sets of one dimension. Raises ConvexSetError."""
        self._sets = as_members(sets, None, "ConvexHull")
        self._removed = bool(remove_empty_sets)
        super().__init__(common_dimension(self._sets, "ConvexHull"))
        self._participating = tuple(s for s in self._sets if not (self._removed and s.is_empty()))

    def sets(self) -> tuple[ConvexSet, ...]:
        """Return all sets, also empty ones."""
        return self._sets

    def participating_sets(self) -> tuple[ConvexSet, ...]:
        """Return the sets that take part."""
        return self._participating

    def element(self, index: int) -> ConvexSet:
        """Return one of all sets. Raises ConvexSetError for a number without one."""
        return member(self._sets, index, "ConvexHull.element")

    def num_elements(self) -> int:
        """Return the number of sets."""
        return len(self._sets)

    def empty_sets_removed(self) -> bool:
        """Return whether empty sets were looked for."""
        return self._removed

    @functools.cached_property
    def corners(self) -> Corners | None:
        """The hull of the corners of the members, where all have them."""
        found = [each.corners for each in self._participating]
        known = [each for each in found if each is not None]
        return Hull(known) if found and len(known) == len(found) else None

    @functools.cached_property
    def _reaches(self) -> ReachOfMembers:
        return ReachOfMembers(self._participating, self.ambient_dimension)

    def _hull_of_points(self) -> Callable[[np.ndarray], ConvexSet] | None:
        is_exact = all(_own_corners(each) is not None for each in self._participating)
        return VPolytope if is_exact else self._hull_of_inner_points

    def _hull_of_inner_points(self, points: np.ndarray) -> ConvexSet:
        """Return the hull of points ``(k, n)`` drawn into the sets, where these surely are."""
        inner = [np.zeros((0, self.ambient_dimension))]
        for each in self._participating:
            start = each.maybe_get_feasible_point()
            if start is not None:
                is_in = each.point_in_set(start + (1.0 - 0.5 * DRAWN_IN) * (points - start), 0.0)
                inner.append(start + (1.0 - DRAWN_IN) * (points[is_in] - start))
        return VPolytope(np.concatenate(inner))

    def _is_quickly_empty(self) -> bool:
        return all(each.is_empty() for each in self._participating)

    def _is_quickly_bounded(self) -> bool | None:
        if all(each.is_bounded() for each in self._participating):
            return True
        # An empty set whose rows leave a direction open takes part in that direction.
        return False if self._removed else None

    def maybe_get_feasible_point(self) -> np.ndarray | None:
        """Return a point ``(n,)`` of one of the sets; None if there is none."""
        points = (each.maybe_get_feasible_point() for each in self._participating)
        return next((point for point in points if point is not None), None)

    def lift(self) -> Lift:
        """Return ``x = x_1 + x_2 + ...``, ``t_1 + t_2 + ... = 1``, x_k in t_k times set k.

        Many sets that are hulls of points themselves are one set of all these points.
        """
        is_many = len(self._participating) > _FEW_MEMBERS
        corners = [_own_corners(each) if is_many else None for each in self._participating]
        hull = [found for found in corners if found is not None]
        others = [
            each for each, found in zip(self._participating, corners, strict=True) if found is None
        ]
        merged = VPolytope(np.concatenate(hull)).lift() if hull else None
        n, lifts = self.ambient_dimension, [each.lift() for each in others]
        if merged is not None:
            if not lifts:
                return merged
            lifts.append(merged)
        total = n + len(lifts) + sum(lift.num_variables for lift in lifts)
        E = np.zeros((n + 1, total))
        E[:n, :n], E[n, n : n + len(lifts)] = np.eye(n), 1.0
        placed, first = [], n + len(lifts)
        for k, lift in enumerate(lifts):
            E[:n, first : first + n] = -np.eye(n)
            placed.append(_scaled(lift, first, n + k, total))
            first += lift.num_variables
        shares = Lift(
            np.zeros((0, total)),
            np.zeros(0),
            -np.eye(total)[n : n + len(lifts)],
            np.zeros(len(lifts)),
        )
        return joined([equations(E, np.append(np.zeros(n), 1.0)), shares, *placed])

    def _support(self, d: np.ndarray) -> Support:
        if not self._participating:
            return super()._support(d)
        values, points, gaps = self._reaches.along(d)
        k = int(values.argmax())
        return Support(float(values[k]), points[k], float(gaps.max()))

    def _inner_reach(self, d: np.ndarray) -> tuple[np.ndarray, float] | None:
        points, moved = self._reaches.inner(d)
        along = product(points, d)
        if np.isnan(along).all():
            return None
        k = int(np.nanargmax(along))
        return points[k], float(moved[k])

    def _pieces(self, d: np.ndarray, within: float) -> list[Piece] | None:
        return self._reaches.pieces(d, within) if self._participating else None

    def _outside(self, points: np.ndarray) -> np.ndarray:
        found = self.projection(points)
        return np.full(len(points), np.inf) if found is None else found.distances


def _own_corners(of: ConvexSet) -> np.ndarray | None:
    """Return points ``(m, n)`` whose hull a set is, without rounding; None where it has none."""
    if isinstance(of, VPolytope):
        return of.vertices if len(of.vertices) else None
    box = own_box(of)
    if box is None or of.ambient_dimension > _MOST_BOX_DIMENSIONS:
        return None
    return VPolytope.make_box(*box).vertices


def _scaled(lift: Lift, first: int, share: int, total: int) -> Lift:
    """Return the rows of a share of a set, from variable ``first`` on: right sides take part."""
    moved = lift.placed(np.arange(first, first + lift.num_variables), total)
    E, A = moved.E.copy(), moved.A.copy()
    E[:, share], A[:, share] = -moved.f, -moved.b
    cones = tuple(
        Ball(c.columns, share) if isinstance(c, Ball) and c.scale < 0 else c for c in moved.cones
    )
    return Lift(E, np.zeros(len(E)), A, np.zeros(len(A)), cones)
