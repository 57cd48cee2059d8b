"""Points, lines, planes and their like in any number of dimensions."""

from __future__ import annotations

from typing import Any

import numpy as np

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.convex.questions.answers import Projection, Support
from scene_graph_ros.convex.questions.arguments import (
    as_matrix,
    as_nonnegative,
    as_points,
    as_vector,
)
from scene_graph_ros.convex.sets.convex_set import ConvexSet
from scene_graph_ros.convex.solve.cones.lift import Lift
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = ["AffineSubspace"]

_FLAT = 1e-12
"""Relative to a set's size: a set thinner than this along a direction has no width there."""

_ROUNDING = 64.0 * EPSILON
"""Relative to the coordinates of a set: a width below it is what rounding made of none."""


_NOTHING = np.zeros((0, 0))


class AffineSubspace(ConvexSet):
    """All ``translation + basis @ y``: ``basis (n, k)`` of full rank, ``translation (n,)``.

    ``AffineSubspace(some_set, tol=None)`` is the affine hull of a set that isn't empty: directions
    in which it is no wider than ``tol`` don't count. By default that is 1e-12 of its size.
    """

    _IS_NEVER_EMPTY = True

    def __init__(
        self, basis: Any = _NOTHING, translation: Any = (), *, tol: float | None = None
    ) -> None:
        """Take a basis or a set. Raises ConvexSetError unless columns are independent."""
        if isinstance(basis, ConvexSet):
            basis, translation = _affine_hull(basis, tol)
        self._basis = as_matrix(basis, "AffineSubspace: basis")
        self._translation = as_vector(translation, "AffineSubspace: translation", len(self._basis))
        n, k = self._basis.shape
        # The rank of directions: lengths of columns say nothing.
        lengths = np.linalg.norm(self._basis, axis=0)
        unit = self._basis / np.where(lengths > 0.0, lengths, 1.0)
        left, values, _ = np.linalg.svd(unit)
        if k > n or (k and values[-1] <= n * EPSILON * values[0]):
            raise ConvexSetError(
                f"AffineSubspace: the {k} columns of basis must be linearly independent, in {n}"
                " dimensions; leave out those that depend on others"
            )
        self._span, self._complement = left[:, :k], left[:, k:]
        super().__init__(n)

    @property
    def basis(self) -> np.ndarray:
        """The directions as columns ``(n, k)``."""
        return self._basis

    @property
    def translation(self) -> np.ndarray:
        """A point ``(n,)`` of the set."""
        return self._translation

    def affine_dimension(self) -> int:
        """Return the number k of independent directions."""
        return self._basis.shape[1]

    def orthogonal_complement_basis(self) -> np.ndarray:
        """Return orthonormal columns ``(n, n - k)``, square to the set."""
        return self._complement

    def to_local_coordinates(self, x: Any) -> np.ndarray:
        """Return y ``(k,)`` of the nearest point of the set to x ``(n,)``; batches are rows."""
        points, is_one = as_points(
            x, "AffineSubspace.to_local_coordinates: x", self.ambient_dimension
        )
        y = np.linalg.lstsq(self._basis, (points - self._translation).T)[0].T
        return y[0] if is_one else y

    def to_global_coordinates(self, y: Any) -> np.ndarray:
        """Return the points ``translation + basis @ y`` of y ``(k,)``; batches are rows."""
        label = "AffineSubspace.to_global_coordinates: y"
        local, is_one = as_points(y, label, self.affine_dimension())
        x = self._translation + local @ self._basis.T
        return x[0] if is_one else x

    def contained_in(self, other: AffineSubspace, tol: float = 1e-15) -> bool:
        """Tell whether the set is part of another, to a tolerance.

        ``tol`` is a distance for the translation, relative to its rounding, and the sine of an
        angle for directions.
        """
        self._check_other(other, "contained_in", AffineSubspace)
        most = as_nonnegative(tol, "AffineSubspace.contained_in: tol")
        across = other.orthogonal_complement_basis().T
        size = 1.0 + np.abs(self._translation).max(initial=0.0)
        off = np.abs(across @ (self._translation - other.translation)).max(initial=0.0)
        turned = np.abs(across @ self._span).max(initial=0.0)
        rounding = 8.0 * EPSILON * self.ambient_dimension
        return bool(off <= most + rounding * size and turned <= most + rounding)

    def is_nearly_equal_to(self, other: AffineSubspace, tol: float = 1e-15) -> bool:
        """Tell whether each is part of the other, to a tolerance as in `contained_in`."""
        self._check_other(other, "is_nearly_equal_to", AffineSubspace)
        return self.contained_in(other, tol) and other.contained_in(self, tol)

    def lift(self) -> Lift:
        """Return one equation for each coordinate: ``x - basis @ y = translation``."""
        n, k = self._basis.shape
        E = np.concatenate([np.eye(n), -self._basis], axis=1)
        return Lift(E, self._translation, np.zeros((0, n + k)), np.zeros(0))

    def maybe_get_point(self) -> np.ndarray | None:
        """Return the translation where there is no direction."""
        return self._translation if not self.affine_dimension() else None

    def _outside(self, points: np.ndarray) -> np.ndarray:
        return np.linalg.norm((points - self._translation) @ self._complement, axis=1)

    def _support(self, d: np.ndarray) -> Support:
        along = self._span @ (self._span.T @ d)
        if np.linalg.norm(along) > len(d) * EPSILON * np.linalg.norm(d):
            return Support(np.inf, along, 0.0)
        return Support(float(d @ self._translation), self._translation, 0.0)

    def _project(self, points: np.ndarray) -> Projection:
        relative = points - self._translation
        nearest = self._translation + (relative @ self._span) @ self._span.T
        return Projection(self._outside(points), nearest, np.zeros(len(points)))

    @property
    def has_exact_volume(self) -> bool:
        """Always: 0, or infinite for the whole space."""
        return True

    def _volume(self) -> float:
        return np.inf if self.affine_dimension() == self.ambient_dimension else 0.0


def _affine_hull(asked: ConvexSet, tol: float | None) -> tuple[np.ndarray, np.ndarray]:
    """Return an orthonormal basis and a point of a set's affine hull.

    Along directions square to those known, the points furthest both ways are found; where they are
    apart, the way between them is a new direction of the hull.
    """
    if isinstance(asked, AffineSubspace):
        return asked.basis, asked.translation
    most = None if tol is None else as_nonnegative(tol, "AffineSubspace: tol")
    point = asked.maybe_get_feasible_point()
    if point is None:
        raise ConvexSetError("AffineSubspace: the set is empty and has no affine hull")
    n = asked.ambient_dimension
    known, widest = np.zeros((n, 0)), 0.0
    while known.shape[1] < n:
        across = np.linalg.svd(known, full_matrices=True)[0][:, known.shape[1] :]
        found = [_way_across(asked, d) for d in across.T]
        widths = [width for width, _ in found]
        k = int(np.argmax(widths))
        widest = max([widest, *(w for w in widths if np.isfinite(w))])
        # Coordinates themselves are known no better than to rounding.
        least = max(_FLAT * widest, _ROUNDING * float(np.abs(point).max()))
        if not widths[k] > (least if most is None else most):
            break
        way = found[k][1]
        way = way - known @ (known.T @ way)
        way -= known @ (known.T @ way)
        known = np.column_stack([known, way / np.linalg.norm(way)])
    return known, point


def _way_across(asked: ConvexSet, d: np.ndarray) -> tuple[float, np.ndarray]:
    """Return a set's width along a unit vector, and a chord between its ends there."""
    ends = [asked.support(sign * d) for sign in (1.0, -1.0)]
    for end in ends:
        if end.value == np.inf:
            return np.inf, end.point / np.linalg.norm(end.point)
    return ends[0].value + ends[1].value, ends[0].point - ends[1].point
