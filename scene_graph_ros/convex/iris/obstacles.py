"""Questions of regions to obstacles: nearest points to an ellipsoid, and supports."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from scene_graph_ros.convex.errors import ConvexSetError, SolverError
from scene_graph_ros.convex.questions.certificates import Certificate
from scene_graph_ros.convex.sets.affine_ball import AffineBall
from scene_graph_ros.convex.sets.convex_set import ConvexSet
from scene_graph_ros.convex.sets.h_polyhedron import HPolyhedron
from scene_graph_ros.convex.sets.hyperellipsoid import Hyperellipsoid
from scene_graph_ros.convex.sets.hyperrectangle import Hyperrectangle
from scene_graph_ros.convex.sets.intersection import Intersection
from scene_graph_ros.convex.sets.point import Point
from scene_graph_ros.convex.sets.v_polytope import VPolytope
from scene_graph_ros.convex.solve.cones.lift import shared_point
from scene_graph_ros.convex.solve.cutting.cutting import (
    Cut,
    find_in_cones,
    tangent_cuts,
)
from scene_graph_ros.convex.solve.nearest.nearest_by_support import nearest_by_support
from scene_graph_ros.convex.solve.nearest.nearest_in_hull import nearest_in_hull
from scene_graph_ros.geometry.quoting import quoted

__all__ = ["Obstacles"]

_SURE = 1e-9
"""Relative to an ellipsoid's size: how far its map may be from its form."""

_CORNERS_OF_BOXES = 8
"""Dimensions up to which a box is taken by its corners."""


class Obstacles:
    """Obstacles in n dimensions, with balls around them by which most are passed over."""

    def __init__(self, obstacles: Sequence[Any], box: Hyperrectangle) -> None:
        """Take obstacles in a box; of unbounded ones only the part in it counts.

        Raises ConvexSetError for an object that is no set of the box's dimension. Empty sets don't
        count.
        """
        dimension = box.ambient_dimension
        for k, each in enumerate(obstacles):
            label = f"iris: obstacles[{k}]"
            if not isinstance(each, ConvexSet):
                raise ConvexSetError(f"{label} must be a ConvexSet, not {quoted(each)}")
            if each.ambient_dimension != dimension:
                raise ConvexSetError(
                    f"{label} has {each.ambient_dimension} dimensions, the domain has {dimension}"
                )
        self._ellipsoids = [_ellipsoid(each) for each in obstacles]
        self.sets: list[ConvexSet] = [
            each if ball is not None else _within(each, box)
            for each, ball in zip(obstacles, self._ellipsoids, strict=True)
        ]
        self._corners = [_corners(each) for each in self.sets]
        self.counts = np.zeros(len(self.sets), dtype=bool)
        self._centers = np.zeros((len(self.sets), dimension))
        self._radii = np.zeros(len(self.sets))
        self._kinds = [type(each).__name__ for each in obstacles]
        self._stack_corners(dimension)
        self._stack_ellipsoids(dimension)
        self._put_balls_around(box)

    def _stack_corners(self, dimension: int) -> None:
        """Put corners of all hulls in a row, so that one product asks all of them."""
        stacks = [(k, V) for k, V in enumerate(self._corners) if V is not None and len(V)]
        self._with_corners = np.array([k for k, _ in stacks], dtype=np.int64)
        self._stack = np.concatenate([np.zeros((0, dimension)), *[V for _, V in stacks]])
        lengths = np.array([len(V) for _, V in stacks], dtype=np.int64)
        self._starts = np.cumsum(lengths) - lengths

    def _stack_ellipsoids(self, dimension: int) -> None:
        """Put the maps of all ellipsoids in a row, likewise."""
        stacks = [(k, ball.B) for k, ball in enumerate(self._ellipsoids) if ball is not None]
        self._with_maps = np.array([k for k, _ in stacks], dtype=np.int64)
        self._maps = np.array([B for _, B in stacks]).reshape(len(stacks), dimension, dimension)

    def _put_balls_around(self, box: Hyperrectangle) -> None:
        """Find a ball around each obstacle: around all hulls at once, of others one by one."""
        if len(self._starts):
            low, high = (
                each.reduceat(self._stack, self._starts) for each in (np.minimum, np.maximum)
            )
            centers = 0.5 * low + 0.5 * high
            ends = np.append(self._starts[1:], len(self._stack))
            away = self._stack - np.repeat(centers, ends - self._starts, axis=0)
            self._centers[self._with_corners] = centers
            lengths = np.linalg.norm(away, axis=1)
            self._radii[self._with_corners] = np.maximum.reduceat(lengths, self._starts)
            self.counts[self._with_corners] = True
        for k, (each, V, ball) in enumerate(
            zip(self.sets, self._corners, self._ellipsoids, strict=True)
        ):
            if V is None and (ball is not None or not each.is_empty()):
                self._centers[k], self._radii[k] = _ball_around(each, ball, box)
                self.counts[k] = True

    def label(self, k: int) -> str:
        """Name an obstacle in an error."""
        return f"obstacles[{k}] ({self._kinds[k]})"

    def nearest_bounds(self, B: np.ndarray, center: np.ndarray) -> np.ndarray:
        """Return lower bounds ``(m,)`` of ``|B^-1 (x - center)|`` for all x of each obstacle."""
        inverse = np.linalg.inv(B)
        away = np.linalg.norm((self._centers - center) @ inverse.T, axis=1)
        least = away - self._radii * np.linalg.norm(inverse, 2)
        return np.where(self.counts, np.maximum(least, 0.0), np.inf)

    def nearest(self, k: int, B: np.ndarray, center: np.ndarray) -> np.ndarray:
        """Return the point of an obstacle at which ``|B^-1 (x - center)|`` is least, ``(n,)``.

        To rounding for hulls and ellipsoids; the proof of a face does not rest on it.
        """
        each, V = self.sets[k], self._corners[k]
        inverse, origin = np.linalg.inv(B), np.zeros((1, len(center)))
        if V is not None:
            _, weights, failed = nearest_in_hull((V - center) @ inverse.T, origin)
            if failed < 0:
                return np.asarray(weights[0] @ (V - center)) + center
        ball = self._ellipsoids[k]
        if ball is not None:
            moved: ConvexSet = AffineBall(inverse @ ball.B, inverse @ (ball.center - center))
        elif isinstance(each, HPolyhedron):
            moved = HPolyhedron(each.A @ B, each.b - each.A @ center)
        else:
            return self._nearest_of_any(k, B, inverse, center)
        found = moved.projection(origin)
        assert found is not None
        return np.asarray(B @ found.points[0] + center)

    def _nearest_of_any(
        self, k: int, B: np.ndarray, inverse: np.ndarray, center: np.ndarray
    ) -> np.ndarray:
        each = self.sets[k]

        def reach(way: np.ndarray) -> tuple[float, np.ndarray, float]:
            found = each.support(way @ inverse)
            at = inverse @ (found.point - center)
            return float(way @ at), at, found.gap

        return np.asarray(B @ nearest_by_support(reach, np.zeros(len(center)))[1] + center)

    def floor(self, k: int, normal: np.ndarray) -> float:
        """Return a lower bound of ``normal . x`` in an obstacle, less rounding; may be -inf."""
        V = self._corners[k]
        if V is not None:
            return float((V @ normal).min())
        try:
            found = self.sets[k].support(-normal)
        except SolverError:
            return -np.inf
        return -(found.value + found.gap)

    def beyond(self, alive: np.ndarray, normal: np.ndarray, side: float) -> np.ndarray:
        """Return a mask ``(m,)`` of the obstacles with ``normal . x >= side`` everywhere."""
        found = self._centers @ normal - self._radii * np.linalg.norm(normal) >= side
        if len(self._starts):
            floors = np.minimum.reduceat(self._stack @ normal, self._starts)
            found[self._with_corners] |= floors >= side
        asked = np.array([V is None for V in self._corners], dtype=bool)
        if len(self._maps):
            which = self._with_maps
            floors = self._centers[which] @ normal - np.linalg.norm(normal @ self._maps, axis=1)
            sure = _SURE * self._radii[which]
            found[which] |= floors - sure >= side
            asked[which] = floors + sure >= side
        for k in np.flatnonzero(alive & ~found & asked):
            found[k] = self.floor(int(k), normal) >= side
        return found & alive

    def beyond_proven(self, k: int, normal: np.ndarray, side: float) -> Certificate:
        """Return a proof that no point of an obstacle has ``normal . x <= side``.

        Its kind is ``farkas``, or another where that could not be shown.
        """
        each = self.sets[k]
        face = HPolyhedron(normal[None], [side])
        if isinstance(each, VPolytope):
            weights = _weights_of_corners(each.vertices, normal, side)
            kind = "farkas" if weights[len(normal)] < -Fraction(side) else "undecided"
            return Certificate(kind, weights, "intersects_with", (face, each))
        both = shared_point([face.lifted, each.lifted], len(normal))
        found = find_in_cones(both, _tangent_cuts(each, normal))
        return Certificate(
            found.kind,
            found.vector,
            "intersects_with",
            (face, each),
            cuts=found.cuts,
            gap=found.gap,
        )

    def size(self) -> float:
        """Return the largest coordinate there is."""
        reach = np.abs(self._centers).max(axis=1, initial=0.0) + self._radii
        return float(reach[self.counts].max(initial=0.0))


def _corners(each: ConvexSet) -> np.ndarray | None:
    """Return the corners ``(m, n)`` of which a set is the hull, None where it has none at hand."""
    if isinstance(each, VPolytope):
        return each.vertices
    if isinstance(each, Point):
        return each.x[None]
    if isinstance(each, Hyperrectangle) and each.ambient_dimension <= _CORNERS_OF_BOXES:
        return VPolytope.make_box(each.lb, each.ub).vertices
    return None


def _ellipsoid(each: ConvexSet) -> AffineBall | None:
    """Return an ellipsoid as the image of a ball, None for one that is none or unbounded."""
    if isinstance(each, AffineBall):
        return each
    if not isinstance(each, Hyperellipsoid):
        return None
    try:
        return AffineBall(each)
    except ConvexSetError:
        return None


def _weights_of_corners(V: np.ndarray, normal: np.ndarray, side: float) -> tuple[Fraction, ...]:
    """Return weights of ``x = V' w``, ``sum w = 1``, of the face and of ``w >= 0``.

    With the least ``a . v`` of all corners, m, they add up to ``0 <= side - m``.
    """
    a = [Fraction(v) for v in normal.tolist()]
    heights = [
        sum((s * Fraction(v) for s, v in zip(a, corner, strict=True)), Fraction(0))
        for corner in V.tolist()
    ]
    least = min(heights)
    return (*(-s for s in a), -least, Fraction(1), *(height - least for height in heights))


def _tangent_cuts(each: ConvexSet, normal: np.ndarray) -> list[Cut]:
    """Return the planes at the cones of a lift where ``normal . x`` is least.

    Alone they bound it, to rounding, in an ellipsoid; in others they are where to begin.
    """
    lift, n = each.lifted, len(normal)
    if not lift.cones:
        return []
    # Further variables follow from the point in ellipsoids; in others they are one choice.
    x = each.support(-normal).point
    rest = np.linalg.lstsq(lift.E[:, n:], lift.f - lift.E[:, :n] @ x)[0]
    return tangent_cuts(lift.cones, np.append(x, rest))


def _within(each: Any, box: Hyperrectangle) -> Any:
    """Return a set, or the part in a box of one that is unbounded."""
    if isinstance(each, VPolytope | AffineBall | Hyperrectangle) or each.is_bounded():
        return each
    if isinstance(each, HPolyhedron):
        return each.intersection(box.make_h_polyhedron())
    return Intersection([each, box])


def _ball_around(
    each: ConvexSet, ball: AffineBall | None, box: Hyperrectangle
) -> tuple[np.ndarray, float]:
    """Return a ball around a set that is bounded, by the box at least."""
    if ball is not None:
        return ball.center, float(np.linalg.norm(ball.B)) * (1.0 + _SURE)
    # Of what was cut by the box it may be left open whether that bounds it.
    around = Hyperrectangle.maybe_calc_axis_aligned_bounding_box(each) or box
    return around.center(), 0.5 * float(np.linalg.norm(around.ub - around.lb))
