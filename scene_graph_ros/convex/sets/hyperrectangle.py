"""A box with its sides along the axes, in any number of dimensions."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.convex.questions.answers import Projection, Support
from scene_graph_ros.convex.questions.arguments import as_generator, as_vector
from scene_graph_ros.convex.questions.extents import bounds_of
from scene_graph_ros.convex.sets.convex_set import ConvexSet
from scene_graph_ros.convex.sets.h_polyhedron import HPolyhedron
from scene_graph_ros.convex.solve.cones.lift import Lift
from scene_graph_ros.convex.solve.exact.corners import Sides
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.shapes.box import Box
from scene_graph_ros.geometry.shapes.shape import Shape
from scene_graph_ros.geometry.spatial.sums import product

__all__ = ["Hyperrectangle"]


class Hyperrectangle(ConvexSet):
    """All points with ``lb <= x <= ub``; without arguments {0} in no dimensions."""

    _IS_NEVER_EMPTY = True
    _IS_ALWAYS_BOUNDED = True

    def __init__(self, lb: Any = (), ub: Any = ()) -> None:
        """Take two corners. Raises ConvexSetError unless lb and ub are finite and lb <= ub."""
        self._lb = as_vector(lb, "Hyperrectangle: lb")
        self._ub = as_vector(ub, "Hyperrectangle: ub", len(self._lb))
        if (self._lb > self._ub).any():
            k = int(np.flatnonzero(self._lb > self._ub)[0])
            raise ConvexSetError(
                f"Hyperrectangle: lb[{k}] = {float(self._lb[k])!r} must not be above ub[{k}] ="
                f" {float(self._ub[k])!r}; exchange them"
            )
        super().__init__(len(self._lb))

    @property
    def lb(self) -> np.ndarray:
        """The lower bounds ``(n,)``."""
        return self._lb

    @property
    def ub(self) -> np.ndarray:
        """The upper bounds ``(n,)``."""
        return self._ub

    @functools.cached_property
    def corners(self) -> Sides:
        """Its lowest and its highest corner, between which all others are."""
        return Sides(np.stack([self._lb, self._ub]))

    def center(self) -> np.ndarray:
        """Return the centre ``(n,)``."""
        return 0.5 * self._lb + 0.5 * self._ub

    def lift(self) -> Lift:
        """Return two rows for each coordinate: the upper bounds, then the lower ones."""
        n = self.ambient_dimension
        A = np.concatenate([np.eye(n), -np.eye(n)])
        return Lift(np.zeros((0, n)), np.zeros(0), A, np.concatenate([self._ub, -self._lb]))

    def _linear_rows(self) -> tuple[np.ndarray, np.ndarray]:
        return self.lifted.A, self.lifted.b

    @property
    def own_box(self) -> tuple[np.ndarray, np.ndarray]:
        """The corners ``(n,)``."""
        return self._lb, self._ub

    def maybe_get_point(self) -> np.ndarray | None:
        """Return the point where the bounds are equal."""
        return self._lb if (self._lb == self._ub).all() else None

    def make_h_polyhedron(self) -> HPolyhedron:
        """Return the box as a polyhedron."""
        return HPolyhedron.make_box(self._lb, self._ub)

    def maybe_get_intersection(self, other: Hyperrectangle) -> Hyperrectangle | None:
        """Return the box that both have in common, None if there is none."""
        self._check_other(other, "maybe_get_intersection", Hyperrectangle)
        lb, ub = np.maximum(self._lb, other.lb), np.minimum(self._ub, other.ub)
        return Hyperrectangle(lb, ub) if (lb <= ub).all() else None

    def uniform_sample(self, generator: np.random.Generator) -> np.ndarray:
        """Draw a point ``(n,)`` uniformly."""
        as_generator(generator, "Hyperrectangle.uniform_sample: generator")
        share = generator.random(self.ambient_dimension)
        return np.clip(self._lb + share * (self._ub - self._lb), self._lb, self._ub)

    @classmethod
    def maybe_calc_axis_aligned_bounding_box(cls, convex_set: Any) -> Hyperrectangle | None:
        """Return the least box around a set, None if it is unbounded or empty.

        Each bound is outward by the gap of its support, so that the set is inside.
        """
        if not isinstance(convex_set, ConvexSet):
            label = "Hyperrectangle.maybe_calc_axis_aligned_bounding_box: convex_set"
            raise ConvexSetError(f"{label} must be a ConvexSet, not {quoted(convex_set)}")
        bounds = bounds_of(convex_set)
        return None if bounds is None else cls(*bounds)

    def _outside(self, points: np.ndarray) -> np.ndarray:
        return np.linalg.norm(points - np.clip(points, self._lb, self._ub), axis=1)

    def _support(self, d: np.ndarray) -> Support:
        corner = np.where(d > 0.0, self._ub, self._lb)
        return Support(float(product(d, corner)), corner, 0.0)

    def _inner_reach(self, d: np.ndarray) -> tuple[np.ndarray, float] | None:
        return self._support(d).point, 0.0

    def _project(self, points: np.ndarray) -> Projection:
        nearest = np.clip(points, self._lb, self._ub)
        return Projection(np.linalg.norm(points - nearest, axis=1), nearest, np.zeros(len(points)))

    @property
    def has_exact_volume(self) -> bool:
        """Always."""
        return True

    def _volume(self) -> float:
        return float(np.prod(self._ub - self._lb))

    def _shape_with_pose(self) -> tuple[Shape, np.ndarray]:
        pose = np.eye(4)
        pose[:3, 3] = self.center()
        return Box(*(self._ub - self._lb)), pose
