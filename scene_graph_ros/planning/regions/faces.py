"""Faces between an ellipsoid and colliding points, which keep some points inside."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.convex.solve.nearest.nearest_in_hull import nearest_in_hull
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = ["Cut", "cut_between"]

_ROUNDING = 64.0 * EPSILON
"""Relative to coordinates: by so much a face is moved out beyond the points that it keeps."""

_OF_CENTER = 0.5
"""Of the way from a face to the ellipsoid's centre: as far a margin may move the face."""


class Cut:
    """An ellipsoid ``{B u + center}``, and the points ``(k, n)`` that stay inside of cuts."""

    def __init__(
        self, B: NDArray[np.float64], center: NDArray[np.float64], kept: NDArray[np.float64]
    ) -> None:
        self.B, self.center, self.kept = B, center, kept
        self._inverse = np.asarray(np.linalg.inv(B), dtype=np.float64)
        self._balls = (kept - center) @ self._inverse.T

    def distances(self, q: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the factors by which the ellipsoid has to grow to touch each of ``q (m, n)``."""
        result: NDArray[np.float64] = np.linalg.norm((q - self.center) @ self._inverse.T, axis=1)
        return result

    def face(
        self, q: NDArray[np.float64], margin: float
    ) -> tuple[NDArray[np.float64], float] | None:
        """Return a unit normal ``(n,)`` and the side of a face that has ``q (n,)`` beyond it.

        It touches the grown ellipsoid at q, and is moved inwards by ``margin`` or less: the points
        that are kept stay inside, and the centre of the ellipsoid, unless q is within the margin
        of it. Where it would cut one off it is turned, to be between q and the nearest point of
        their hull. None where q is in that hull.
        """
        u: NDArray[np.float64] = (q - self.center) @ self._inverse.T
        normal = _unit(self._inverse.T @ u)
        found = self._side(normal, q, margin)
        if found is not None or not len(self.kept):
            return None if found is None else (normal, found)
        nearest = self._nearest(u)
        normal = _unit(self._inverse.T @ (u - nearest))
        found = self._side(normal, q, margin)
        return None if found is None else (normal, found)

    def _side(
        self, normal: NDArray[np.float64], q: NDArray[np.float64], margin: float
    ) -> float | None:
        """Return the offset of a face, at most at q; None where a point to keep is beyond q."""
        at = float(normal @ q)
        if float(np.linalg.norm(q - self.center)) > margin:
            # Beside a thin ellipsoid a face is near its centre, however far q is.
            margin = min(margin, _OF_CENTER * (at - float(normal @ self.center)))
        if not np.isfinite(at) or not normal.any():
            return None
        if not len(self.kept):
            return at - margin
        reach = self.kept @ normal
        size = max(float(np.abs(self.kept).max(initial=0.0)), float(np.abs(q).max()))
        least = float(reach.max()) + _ROUNDING * size * len(q)
        return None if least >= at else max(at - margin, least)

    def _nearest(self, u: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the hull's nearest point to u, both where the ellipsoid is a unit ball."""
        _, weights, failed = nearest_in_hull(self._balls, u[np.newaxis])
        if failed >= 0:
            return self._balls[np.argmin(np.linalg.norm(self._balls - u, axis=1))]
        return np.asarray(weights[0] @ self._balls)


def cut_between(
    cut: Cut,
    colliding: NDArray[np.float64],
    margin: float,
    most: int,
) -> tuple[list[NDArray[np.float64]], list[float], NDArray[np.float64] | None]:
    """Return faces that have all of some configurations ``(m, n)`` beyond them, nearest first.

    At most ``most`` faces, all where that is negative; and a configuration that no face can keep
    out, as it is in the hull of the points to keep, or None.
    """
    normals: list[NDArray[np.float64]] = []
    sides: list[float] = []
    order = np.argsort(cut.distances(colliding), kind="stable")
    left = colliding[order]
    while len(left) and (most < 0 or len(normals) < most):
        found = cut.face(left[0], margin)
        if found is None:
            return normals, sides, left[0]
        normal, side = found
        normals.append(normal)
        sides.append(side)
        beyond = left @ normal > side
        beyond[0] = True
        left = left[~beyond]
    return normals, sides, None


def _unit(vector: NDArray[np.float64]) -> NDArray[np.float64]:
    length = float(np.linalg.norm(vector))
    return vector / length if length > 0.0 else vector
