"""Parts of sets that reach furthest along a direction, with their gradients and Hessians."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scene_graph_ros.convex.questions.surrounding import ROUNDING
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = ["Ellipsoids", "FacedEllipsoids", "Piece", "corner_piece"]


class Piece(NamedTuple):
    """A part of a set along d: the furthest point of a sum of ellipsoids and of points.

    ``value`` is how far it reaches, ``point (n,)`` where, ``hessian (n, n)`` how the point turns
    with d. It is ``base`` and the sum of ``maps (m, n, n)`` times the unit vectors
    ``ways (m, n)``; of the ways' lengths 1 all but ``drawn (m,)`` are surely inside, where each
    coordinate is off by ``rounding``. ``radii (m,)`` are the least semi-axes. Truly it may reach
    further by ``outward``.
    """

    value: float
    point: np.ndarray
    hessian: np.ndarray
    base: np.ndarray
    maps: np.ndarray
    ways: np.ndarray
    drawn: np.ndarray
    radii: np.ndarray
    rounding: float
    outward: float

    def inner(self) -> np.ndarray:
        """Return the point ``(n,)``, drawn in as far as rounding asks."""
        return self.at((1.0 - self.drawn)[:, None] * self.ways)

    def at(self, ways: np.ndarray) -> np.ndarray:
        """Return the point ``(n,)`` of ways ``(m, n)``."""
        moved: np.ndarray = self.base + np.einsum("mij,mj->i", self.maps, ways)
        return moved

    def moved(self, by: np.ndarray) -> tuple[np.ndarray, float] | None:
        """Return the point ``(n,)`` moved, and the radius of a ball about it in the piece.

        None where it may leave the piece.
        """
        m = len(self.maps)
        if not m:
            return None
        ways = self.ways + np.linalg.solve(self.maps, np.tile(by / m, (m, 1))[:, :, None])[:, :, 0]
        room = 1.0 - self.drawn - (1.0 + 4.0 * EPSILON) * np.linalg.norm(ways, axis=1)
        if not room.min() > 0.0:
            return None
        return self.at(ways), float(room @ self.radii) * (1.0 - 1e-6)


def corner_piece(value: float, point: np.ndarray) -> Piece:
    """Return a piece that is one point ``(n,)``."""
    n = len(point)
    flat, none = np.zeros((n, n)), np.zeros((0, n))
    one = np.zeros(0)
    return Piece(float(value), point, flat, point, np.zeros((0, n, n)), none, one, one, 0.0, 0.0)


class Ellipsoids:
    """Images of the unit ball by ``maps (m, n, n)`` about ``centers (m, n)``.

    Of ``sizes (m,)`` are their coordinates; ``drawn (m,)`` is as a piece's, NaN where unknown.
    """

    def __init__(
        self, maps: np.ndarray, centers: np.ndarray, drawn: np.ndarray, sizes: np.ndarray
    ) -> None:
        self.maps, self.centers, self.drawn = maps, centers, drawn
        self.rounding = ROUNDING * maps.shape[2] * sizes
        # The axes of a form are off by what its points are drawn in for, the points by rounding.
        self.outward = drawn * sizes + np.sqrt(maps.shape[2]) * self.rounding
        self._squares = np.einsum("mij,mkj->mik", maps, maps)
        self.radii = np.linalg.svd(maps, compute_uv=False)[:, -1] if len(maps) else np.zeros(0)
        self._is_known = bool((self.radii > 0.0).all()) and not np.isnan(drawn).any()

    def along(self, d: np.ndarray) -> FacedEllipsoids | None:
        """Return how far each reaches along a unit vector; None where one is flat, or unknown."""
        if not self._is_known:
            return None
        stretched = np.einsum("i,mij->mj", d, self.maps)
        lengths = np.sqrt(np.einsum("mj,mj->m", stretched, stretched))
        ways = stretched / lengths[:, None]
        away = np.einsum("mij,mj->mi", self.maps, ways)
        # The gradient's derivative, of d -> M M' d / |M' d|.
        hessians = self._squares - away[:, :, None] * away[:, None, :]
        hessians /= lengths[:, None, None]
        values = np.einsum("mi,i->m", self.centers, d) + lengths
        return FacedEllipsoids(self, values, self.centers + away, ways, hessians)


class FacedEllipsoids(NamedTuple):
    """How far ellipsoids reach along d ``(m,)``, where ``(m, n)``, and as pieces have them."""

    of: Ellipsoids
    values: np.ndarray
    points: np.ndarray
    ways: np.ndarray
    hessians: np.ndarray

    def piece(self, k: int) -> Piece:
        """Return one of them as a piece."""
        of, one = self.of, slice(k, k + 1)
        own = of.maps[one], self.ways[one], of.drawn[one], of.radii[one]
        reach = float(self.values[k]), self.points[k], self.hessians[k], of.centers[k]
        return Piece(*reach, *own, float(of.rounding[k]), float(of.outward[k]))
