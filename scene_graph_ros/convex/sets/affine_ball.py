"""An ellipsoid as the image of the unit ball; it may be flat."""

from __future__ import annotations

import functools
import math
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
from scene_graph_ros.convex.sets.convex_set import ConvexSet
from scene_graph_ros.convex.solve.cones.lift import Ball, Lift
from scene_graph_ros.geometry.shapes.ellipsoid import Ellipsoid
from scene_graph_ros.geometry.shapes.shape import Shape
from scene_graph_ros.geometry.shapes.sphere import Sphere
from scene_graph_ros.geometry.tolerances import COINCIDENCE, EPSILON

__all__ = ["AffineBall"]

_NOTHING = np.zeros((0, 0))

_MOST_DIMENSIONS = 10_000
"""Of which a square matrix still fits in memory."""

_SURE = 0.01
"""Of a ratio at which a ball counts as flat: below, the bound of its rounded inverse will do."""


class AffineBall(ConvexSet):
    """All ``B u + center`` with ``|u| <= 1``: ``B (n, n)``. It is never empty, always bounded.

    ``AffineBall(hyperellipsoid)`` is the same set, where that is bounded.
    """

    _IS_NEVER_EMPTY = True
    _IS_ALWAYS_BOUNDED = True

    def __init__(self, B: Any = _NOTHING, center: Any = ()) -> None:
        """Take a map or an ellipsoid. Raises ConvexSetError unless they fit."""
        image = B._ball_map() if isinstance(B, ConvexSet) else None
        if image is not None:
            B, center = image
        self._B = as_matrix(B, "AffineBall: B")
        self._center = as_vector(center, "AffineBall: center", len(self._B))
        if self._B.shape[0] != self._B.shape[1]:
            raise ConvexSetError(f"AffineBall: B must be square, not {self._B.shape}")
        super().__init__(len(self._center))

    @classmethod
    def make_axis_aligned(cls, radius: Any, center: Any) -> AffineBall:
        """Return the ellipsoid of radii ``(n,)``, at least 0, along the axes about a centre."""
        radii = as_vector(radius, "AffineBall.make_axis_aligned: radius")
        if not (radii >= 0.0).all():
            raise ConvexSetError(
                f"AffineBall.make_axis_aligned: radius must be at least 0, not {radii.tolist()}"
            )
        return cls(np.diag(radii), center)

    @classmethod
    def make_hypersphere(cls, radius: float, center: Any) -> AffineBall:
        """Return the ball of a radius, at least 0, about ``center (n,)``."""
        about = as_vector(center, "AffineBall.make_hypersphere: center")
        size = as_number(radius, "AffineBall.make_hypersphere: radius")
        return cls.make_axis_aligned(np.full(len(about), size), about)

    @classmethod
    def make_unit_ball(cls, dim: int) -> AffineBall:
        """Return the ball of radius 1 about the origin."""
        n = as_whole(dim, "AffineBall.make_unit_ball: dim", 0, _MOST_DIMENSIONS)
        return cls(np.eye(n), np.zeros(n))

    @classmethod
    def make_affine_ball_from_line_segment(
        cls, x_1: Any, x_2: Any, epsilon: float = 1e-3
    ) -> AffineBall:
        """Return the ellipsoid with the ends ``(n,)`` of a segment as tips, thin across it.

        ``epsilon``, at least 0, is its radius across. Raises ConvexSetError for equal ends.
        """
        label = "AffineBall.make_affine_ball_from_line_segment"
        first = as_vector(x_1, f"{label}: x_1")
        second = as_vector(x_2, f"{label}: x_2", len(first))
        across = as_nonnegative(epsilon, f"{label}: epsilon")
        half = 0.5 * (second - first)
        length = float(np.linalg.norm(half))
        if length == 0.0:
            raise ConvexSetError(f"{label}: x_1 and x_2 must differ, not {first.tolist()} both")
        # The segment's direction comes first, and what completes it to a basis after it.
        basis, _ = np.linalg.qr(np.column_stack([half, np.eye(len(first))]))
        B = across * basis
        B[:, 0] = half
        return cls(B, first + half)

    @classmethod
    def minimum_volume_circumscribed_ellipsoid(
        cls, points: Any, rank_tol: float = 1e-6
    ) -> AffineBall:
        """Return the smallest ellipsoid around points ``(m, n)``, which holds all of them.

        In the affine hull of the points where that is flat: a direction counts with a singular
        value above ``rank_tol`` times the largest. Raises ConvexSetError without points.
        Its log volume is within 1e-7 for each dimension of the smallest.
        """
        label = "AffineBall.minimum_volume_circumscribed_ellipsoid"
        checked = as_matrix(points, f"{label}: points")
        found, _ = circumscribed(checked, as_nonnegative(rank_tol, f"{label}: rank_tol"), label)
        return cls(found.B, found.center)

    @property
    def B(self) -> np.ndarray:
        """The map ``(n, n)``."""
        return self._B

    @property
    def center(self) -> np.ndarray:
        """The centre ``(n,)``."""
        return self._center

    def inverse(self) -> np.ndarray:
        """Return the inverse map ``(n, n)``. Raises ConvexSetError for a flat set."""
        try:
            inverse: np.ndarray = np.linalg.inv(self._B)
        except np.linalg.LinAlgError:
            inverse = np.full_like(self._B, np.inf)
        # Singular values differ by no more than the product of both sums of squares.
        spread = math.sqrt(np.vdot(self._B, self._B)) * math.sqrt(np.vdot(inverse, inverse))
        if spread * self._ambient_dimension * EPSILON < _SURE:
            return inverse
        values = np.linalg.svd(self._B, compute_uv=False)
        if len(values) and values[-1] <= len(values) * EPSILON * values[0]:
            raise ConvexSetError(
                "AffineBall: the set is flat, with singular values"
                f" {values.tolist()}, and no Hyperellipsoid; keep the AffineBall"
            )
        return inverse

    def lift(self) -> Lift:
        """Return ``x - B u = center`` with u in the unit ball."""
        n = self.ambient_dimension
        E = np.concatenate([np.eye(n), -self._B], axis=1)
        ball = Ball(np.arange(n, 2 * n))
        return Lift(E, self._center, np.zeros((0, 2 * n)), np.zeros(0), (ball,) if n else ())

    @functools.cached_property
    def _axes(self) -> tuple[np.ndarray, np.ndarray]:
        axes, radii, _ = np.linalg.svd(self._B)
        return axes, radii

    def maybe_get_point(self) -> np.ndarray | None:
        """Return the centre where B is zero."""
        return None if self._B.any() else self._center

    def _outside(self, points: np.ndarray) -> np.ndarray:
        return distances_to_axes(*self._axes, self._center, points)

    def _support(self, d: np.ndarray) -> Support:
        return support_of_axes(*self._axes, self._center, d)

    @property
    def drawn_in(self) -> float:
        """Nothing: points of the map are inside but for the rounding of their coordinates."""
        return 0.0

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
        axes, radii = self._axes
        pose = np.eye(4)
        pose[:3, 3] = self._center
        if np.ptp(radii) <= COINCIDENCE * radii[0]:
            return Sphere(float(radii[0])), pose
        pose[:3, :3] = axes * np.array([1.0, 1.0, np.sign(np.linalg.det(axes))])
        return Ellipsoid(*radii.tolist()), pose
