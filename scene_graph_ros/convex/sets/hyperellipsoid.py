"""An ellipsoid as a sublevel set of a quadratic form; it may be unbounded."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.convex.questions.answers import Projection, Support
from scene_graph_ros.convex.questions.arguments import (
    as_matrix,
    as_nonnegative,
    as_number,
    as_vector,
    as_whole,
)
from scene_graph_ros.convex.questions.axes import (
    distances_to_axes,
    inner_of_axes,
    pieces_of_axes,
    project_on_axes,
    support_of_axes,
    unit_ball_volume,
)
from scene_graph_ros.convex.questions.ellipsoids import circumscribed
from scene_graph_ros.convex.questions.pieces import Piece
from scene_graph_ros.convex.questions.surrounding import WELL_CONDITIONED
from scene_graph_ros.convex.sets.affine_ball import AffineBall
from scene_graph_ros.convex.sets.convex_set import ConvexSet
from scene_graph_ros.convex.sets.from_shapes import (
    ellipsoid_of,
    is_query,
    placed_shape,
)
from scene_graph_ros.convex.solve.cones.lift import Ball, Lift
from scene_graph_ros.geometry.model.ids import FrameId
from scene_graph_ros.geometry.shapes.shape import Shape
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = ["Hyperellipsoid"]

_NOTHING = np.zeros((0, 0))

_MOST_DIMENSIONS = 10_000
"""Of which a square matrix still fits in memory."""


class Hyperellipsoid(ConvexSet):
    """All x with ``|A (x - center)| <= 1``: ``A (m, n)``, ``center (n,)``. It is never empty.

    ``Hyperellipsoid(affine_ball)`` is the same set, where that is not flat;
    ``Hyperellipsoid(query, geometry_id, reference_frame=None)`` a registered sphere or ellipsoid.
    """

    _IS_NEVER_EMPTY = True

    def __init__(
        self, A: Any = _NOTHING, center: Any = (), reference_frame: FrameId | None = None
    ) -> None:
        """Take a form, a ball or a geometry. Raises ConvexSetError unless they fit."""
        if is_query(A):
            radii, X_FG = ellipsoid_of(*placed_shape(A, center, reference_frame), "Hyperellipsoid")
            A, center = (X_FG[:3, :3] / radii).T, X_FG[:3, 3]
        elif isinstance(A, AffineBall):
            A, center = A.inverse(), A.center
        self._A = as_matrix(A, "Hyperellipsoid: A")
        self._center = as_vector(center, "Hyperellipsoid: center", self._A.shape[1])
        super().__init__(self._A.shape[1])

    @property
    def form(self) -> tuple[np.ndarray, np.ndarray]:
        """The matrix ``(m, n)`` and the centre ``(n,)``."""
        return self._A, self._center

    @classmethod
    def make_axis_aligned(cls, radius: Any, center: Any) -> Hyperellipsoid:
        """Return the ellipsoid of positive radii ``(n,)`` along the axes about ``center (n,)``."""
        radii = as_vector(radius, "Hyperellipsoid.make_axis_aligned: radius")
        if not (radii > 0.0).all():
            raise ConvexSetError(
                f"Hyperellipsoid.make_axis_aligned: radius must be positive, not {radii.tolist()};"
                " an AffineBall may be flat"
            )
        return cls(np.diag(1.0 / radii), center)

    @classmethod
    def make_hypersphere(cls, radius: float, center: Any) -> Hyperellipsoid:
        """Return the ball of a positive radius about ``center (n,)``."""
        about = as_vector(center, "Hyperellipsoid.make_hypersphere: center")
        size = as_number(radius, "Hyperellipsoid.make_hypersphere: radius")
        return cls.make_axis_aligned(np.full(len(about), size), about)

    @classmethod
    def make_unit_ball(cls, dim: int) -> Hyperellipsoid:
        """Return the ball of radius 1 about the origin."""
        n = as_whole(dim, "Hyperellipsoid.make_unit_ball: dim", 0, _MOST_DIMENSIONS)
        return cls(np.eye(n), np.zeros(n))

    @classmethod
    def minimum_volume_circumscribed_ellipsoid(
        cls, points: Any, rank_tol: float = 1e-6
    ) -> Hyperellipsoid:
        """Return the smallest ellipsoid around points ``(m, n)``, which holds all of them.

        Raises ConvexSetError where a singular value is at most ``rank_tol`` times the largest.
        Its log volume is within 1e-7 for each dimension of the smallest.
        """
        label = "Hyperellipsoid.minimum_volume_circumscribed_ellipsoid"
        checked = as_matrix(points, f"{label}: points")
        found, rank = circumscribed(checked, as_nonnegative(rank_tol, f"{label}: rank_tol"), label)
        if rank < checked.shape[1]:
            raise ConvexSetError(
                f"{label}: points have the rank {rank} in {checked.shape[1]} dimensions; use"
                " AffineBall.minimum_volume_circumscribed_ellipsoid"
            )
        # The form is an inverse, which rounding moved: none may be left outside.
        return cls(_around(checked - found.center, found.B, found.center), found.center)

    @property
    def A(self) -> np.ndarray:
        """The form ``(m, n)``."""
        return self._A

    @property
    def center(self) -> np.ndarray:
        """The centre ``(n,)``."""
        return self._center

    def _ball_map(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the pseudo-inverse of A, and the centre; raises ConvexSetError if unbounded."""
        A = self._A
        values = np.linalg.svd(A, compute_uv=False)
        n = A.shape[1]
        if n and (len(values) < n or values[n - 1] <= max(A.shape) * EPSILON * values[0]):
            raise ConvexSetError(
                "AffineBall: the Hyperellipsoid is unbounded, as A has not the rank"
                f" {n}; keep the Hyperellipsoid"
            )
        if A.shape[0] == n:
            return (np.linalg.inv(A) if n else np.zeros((0, 0))), self._center
        _, values, axes = np.linalg.svd(A, full_matrices=False)
        return (axes.T / values) @ axes, self._center

    def lift(self) -> Lift:
        """Return a unit ball of ``w = A x - A z`` with ``z = center``."""
        m, n = self._A.shape
        E = np.zeros((m + n, 2 * n + m))
        E[:m, :n], E[:m, n : 2 * n], E[:m, 2 * n :] = -self._A, self._A, np.eye(m)
        E[m:, n : 2 * n] = np.eye(n)
        f = np.append(np.zeros(m), self._center)
        ball = Ball(np.arange(2 * n, 2 * n + m))
        return Lift(E, f, np.zeros((0, 2 * n + m)), np.zeros(0), (ball,))

    @functools.cached_property
    def _axes(self) -> tuple[np.ndarray, np.ndarray]:
        """Axes as columns ``(n, n)`` and radii ``(n,)``, infinite where nothing bounds."""
        n = self.ambient_dimension
        _, values, axes = np.linalg.svd(self._A, full_matrices=True)
        found = np.zeros(n)
        found[: len(values)] = values
        # A direction that the form knows by rounding alone is free.
        known = found > max(self._A.shape) * EPSILON * found.max(initial=0.0)
        return axes.T, np.divide(1.0, found, out=np.full(n, np.inf), where=known)

    def _is_quickly_bounded(self) -> bool | None:
        # Radii are finite where the form's rank is beyond doubt; elsewhere it is decided exactly.
        return True if np.isfinite(self._axes[1]).all() else None

    def minimum_uniform_scaling_to_touch(self, other: ConvexSet) -> tuple[float, np.ndarray]:
        """Return the smallest factor of this set about its centre at which it meets another.

        And the point ``(n,)`` of the other set there. Raises ConvexSetError for a set that is
        empty or of another dimension, and for an unbounded form.
        """
        self._check_other(other, "minimum_uniform_scaling_to_touch")
        if not self.ambient_dimension or np.isinf(self._axes[1]).any():
            raise ConvexSetError(
                "Hyperellipsoid.minimum_uniform_scaling_to_touch: the ellipsoid must be bounded,"
                " in at least one dimension"
            )
        from scene_graph_ros.convex.questions.generic import nearest_in_form
        from scene_graph_ros.convex.sets.nearest_by_image import nearest_by_image

        axes, radii = self._axes
        quick = nearest_by_image(other, self._A, self._center, axes * radii)
        if quick is not None:
            return quick
        distance, point, _ = nearest_in_form(other, self._A, self._center)
        return distance, point

    def _outside(self, points: np.ndarray) -> np.ndarray:
        return distances_to_axes(*self._axes, self._center, points)

    def _support(self, d: np.ndarray) -> Support:
        return support_of_axes(*self._axes, self._center, d)

    @functools.cached_property
    def drawn_in(self) -> float | None:
        """Share of its way to the centre that moves any computed point of the surface inside.

        Of the axes of a form rounding moves as much as the form is thin. None where the set is
        unbounded, or nothing but the exact form tells.
        """
        least, most = self._axes[1].min(initial=np.inf), self._axes[1].max(initial=0.0)
        if not most <= WELL_CONDITIONED * least or np.isinf(most):
            return None
        return 64.0 * (self.ambient_dimension + 2) * EPSILON * float(most / least)

    def _pieces(self, d: np.ndarray, within: float) -> list[Piece] | None:
        return pieces_of_axes(*self._axes, self._center, self.drawn_in, d)

    def _inner_reach(self, d: np.ndarray) -> tuple[np.ndarray, float] | None:
        return inner_of_axes(*self._axes, self._center, d, self.drawn_in)

    def _project(self, points: np.ndarray) -> Projection:
        return project_on_axes(*self._axes, self._center, points)

    @property
    def has_exact_volume(self) -> bool:
        """Always."""
        return True

    def _volume(self) -> float:
        return unit_ball_volume(self.ambient_dimension) * float(np.prod(self._axes[1]))

    def _shape_with_pose(self) -> tuple[Shape, np.ndarray]:
        return AffineBall(self).to_shape_with_pose()


def _reached_at_most(A: np.ndarray, points: np.ndarray) -> float:
    """Return an upper bound of the largest ``|A x|`` of points ``(m, n)``, rounded differences."""
    values, sizes = points @ A.T, np.abs(points) @ np.abs(A.T)
    rounding = (A.shape[1] + 4) * EPSILON * sizes
    return float(np.linalg.norm(np.abs(values) + rounding, axis=1).max())


def _around(points: np.ndarray, B: np.ndarray, center: np.ndarray) -> np.ndarray:
    """Return a form ``A`` near the inverse of B with all points ``(m, n)`` in its ellipsoid."""
    inverse = AffineBall(B, center).inverse()
    A, room = inverse, EPSILON
    while (reached := _reached_at_most(A, points)) > 1.0:
        # The entries of a thin ellipsoid's form are rounded, too.
        A, room = inverse / (reached * (1.0 + room)), 2.0 * room
        inverse = A
    return A
