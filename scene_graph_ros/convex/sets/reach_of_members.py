"""How far each of many sets reaches along a direction, in a few calls for all of them.

Members that are hulls of points, boxes or ellipsoids are kept as arrays; others are asked one by
one.
"""

from __future__ import annotations

import functools
from typing import NamedTuple

import numpy as np

from scene_graph_ros.convex.questions.pieces import (
    corner_piece,
    Ellipsoids,
    FacedEllipsoids,
    Piece,
)
from scene_graph_ros.convex.questions.surrounding import (
    ROUNDING,
)
from scene_graph_ros.convex.sets.affine_ball import AffineBall
from scene_graph_ros.convex.sets.convex_set import ConvexSet
from scene_graph_ros.convex.sets.hyperellipsoid import Hyperellipsoid
from scene_graph_ros.convex.sets.hyperrectangle import Hyperrectangle
from scene_graph_ros.convex.sets.point import Point
from scene_graph_ros.convex.sets.row_set import RowSet
from scene_graph_ros.convex.sets.v_polytope import VPolytope
from scene_graph_ros.convex.solve.floats.quick_supports import supports_quickly
from scene_graph_ros.geometry.spatial.sums import product
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = ["Reach", "ReachOfMembers"]


_DRAWN_IN = 1e-10
"""Of the way to the centre of a polyhedron: so much a corner is moved to be inside."""


class Reach(NamedTuple):
    """Of m sets: how far ``(m,)``, at which points ``(m, n)``, and bounds of shortfalls ``(m,)``.

    Points are directions where a value is infinite.
    """

    values: np.ndarray
    points: np.ndarray
    gaps: np.ndarray


class ReachOfMembers:
    """Sets of one dimension n, none of them empty, sorted by how they are asked."""

    def __init__(self, members: tuple[ConvexSet, ...], n: int) -> None:
        self._members, self._n = members, n
        corners: list[int] = []
        boxes: list[int] = []
        balls: list[int] = []
        rows: list[int] = []
        self._others: list[int] = []
        for k, each in enumerate(members):
            kept = self._others
            if isinstance(each, Point) or (isinstance(each, VPolytope) and len(each.vertices)):
                kept = corners
            elif isinstance(each, Hyperrectangle):
                kept = boxes
            elif _is_bounded_ball(each):
                kept = balls
            elif isinstance(each, RowSet) and each.center_in_floats is not None:
                kept = rows
            kept.append(k)
        self._corners, self._boxes, self._balls, self._rows = (
            np.array(which, dtype=np.int64) for which in (corners, boxes, balls, rows)
        )
        hulls = [np.atleast_2d(_points_of(members[k])) for k in corners]
        self._counts = np.array([len(points) for points in hulls], dtype=np.int64)
        self._firsts = np.cumsum(self._counts) - self._counts
        own = [members[k]._linear_rows() for k in rows]
        self._A = np.concatenate([np.zeros((0, n)), *(each[0] for each in own if each)])
        self._b = np.concatenate([np.zeros(0), *(each[1] for each in own if each)])
        self._row_firsts = np.cumsum([0, *(len(each[1]) for each in own if each)])
        starts = [members[k].center_in_floats for k in rows]  # type: ignore[attr-defined]
        self._starts = np.array(starts).reshape(-1, n)
        self._points = np.concatenate([np.zeros((0, n)), *hulls])
        self._sides = np.array([[members[k].lb, members[k].ub] for k in boxes]).reshape(-1, 2, n)  # type: ignore[attr-defined]
        axes = [members[k]._axes for k in balls]  # type: ignore[attr-defined]
        self._maps = np.array([u * radii for u, radii in axes]).reshape(-1, n, n)
        self._centers = np.array([members[k].center for k in balls]).reshape(-1, n)  # type: ignore[attr-defined]
        self._sizes = np.abs(self._centers).max(axis=1, initial=0.0)
        self._sizes += np.abs(self._maps).max(axis=(1, 2), initial=0.0)
        drawn = [members[k].drawn_in for k in balls]  # type: ignore[attr-defined]
        # A point that is not known to be inside is no number.
        self._drawn = np.array([np.nan if each is None else each for each in drawn])

    def along(self, d: np.ndarray) -> Reach:
        """Return the support of each set along d ``(n,)``."""
        found = self._arrays(d, np.zeros(len(self._drawn)))
        points, gaps = self._of_rows(d)
        found.points[self._rows], found.gaps[self._rows] = points, gaps
        found.values[self._rows] = product(points, d)
        for k in [*self._others, *self._rows[gaps < 0.0]]:
            found.values[k], found.points[k], found.gaps[k] = self._members[k].support(d)
        return found

    def inner(self, d: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return a point ``(m, n)`` of each set, nearly as far along d as it reaches.

        Behind them is what rounding may have moved their coordinates by ``(m,)``. Rows are NaN
        where no such point is known.
        """
        points, moved = self._arrays(d, self._drawn).points, np.zeros(len(self._members))
        moved[self._balls] = ROUNDING * self._n * self._sizes
        points[self._rows] = self._inner_of_rows(d)
        moved[self._rows] = ROUNDING * np.abs(points[self._rows]).max(axis=1, initial=0.0)
        for k in self._others:
            inner = self._members[k]._inner_reach(d)
            points[k], moved[k] = (np.nan, 0.0) if inner is None else inner
        return points, moved

    def pieces(self, d: np.ndarray, within: float) -> list[Piece] | None:
        """Return the sets that reach furthest along a unit vector, but for ``within``.

        None where some are neither ellipsoids, boxes nor hulls of points, or are flat or too thin.
        """
        found = self._curved(d)
        if found is None:
            return None
        reach, balls = found
        own = {k: i for i, k in enumerate(self._balls.tolist())}
        near = np.flatnonzero(reach.values >= float(reach.values.max()) - within).tolist()
        return [
            balls.piece(own[k]) if k in own else corner_piece(reach.values[k], reach.points[k])
            for k in near
        ]

    def piece_of_sum(self, d: np.ndarray) -> list[Piece] | None:
        """Return the sum of the sets along a unit vector as one piece; None as `pieces`."""
        found = self._curved(d)
        if found is None:
            return None
        reach, balls = found
        of, value, point = balls.of, float(reach.values.sum()), reach.points.sum(axis=0)
        added = len(reach.values) * EPSILON * float(np.abs(reach.points).sum(axis=0).max())
        off = added + float(of.rounding.sum()), np.sqrt(self._n) * added + float(of.outward.sum())
        base = point + (of.centers - reach.points[self._balls]).sum(axis=0)
        hessian = balls.hessians.sum(axis=0)
        own = of.maps, balls.ways, of.drawn, of.radii
        return [Piece(value, point, hessian, base, *own, *off)]

    @functools.cached_property
    def _ellipsoids(self) -> Ellipsoids:
        return Ellipsoids(self._maps, self._centers, self._drawn, self._sizes)

    def _curved(self, d: np.ndarray) -> tuple[Reach, FacedEllipsoids] | None:
        """Return how far all reach, and the ellipsoids among them."""
        if self._others or len(self._rows):
            return None
        balls = self._ellipsoids.along(d)
        return None if balls is None else (self._arrays(d, np.zeros(len(self._drawn))), balls)

    def _of_rows(self, d: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        points, gaps = np.empty(self._starts.shape), np.empty(len(self._starts))
        if len(gaps):
            supports_quickly(self._A, self._b, self._row_firsts, self._starts, d, points, gaps)
        return points, gaps

    def _inner_of_rows(self, d: np.ndarray) -> np.ndarray:
        """Return points ``(k, n)``; half as far from the centre keeps all rows, rounding too."""
        points, gaps = self._of_rows(d)
        ways = points - self._starts
        counts = np.diff(self._row_firsts)
        halfway = np.repeat(self._starts + (1.0 - 0.5 * _DRAWN_IN) * ways, counts, axis=0)
        off = np.einsum("mi,mi->m", self._A, halfway) - self._b
        size = np.einsum("mi,mi->m", np.abs(self._A), np.abs(halfway)) + np.abs(self._b)
        is_out = (off > -ROUNDING * self._n * size).astype(np.float64)
        inner: np.ndarray = self._starts + (1.0 - _DRAWN_IN) * ways
        if len(inner):
            inner[(gaps < 0.0) | (np.add.reduceat(is_out, self._row_firsts[:-1]) > 0.0)] = np.nan
        return inner

    def _arrays(self, d: np.ndarray, drawn: np.ndarray) -> Reach:
        m = len(self._members)
        found = Reach(np.zeros(m), np.zeros((m, self._n)), np.zeros(m))
        if len(self._corners):
            along = product(self._points, d)
            most = np.maximum.reduceat(along, self._firsts)
            furthest = np.flatnonzero(along == np.repeat(most, self._counts))
            found.points[self._corners] = self._points[
                furthest[np.searchsorted(furthest, self._firsts)]
            ]
            found.values[self._corners] = most
        if len(self._boxes):
            corner = np.where(d > 0.0, self._sides[:, 1], self._sides[:, 0])
            found.points[self._boxes], found.values[self._boxes] = corner, product(corner, d)
        if len(self._balls):
            stretched = np.einsum("i,mij->mj", d, self._maps)
            lengths = np.linalg.norm(stretched, axis=1)
            ways = stretched / np.where(lengths > 0.0, lengths, 1.0)[:, None]
            ways *= (1.0 - drawn)[:, None]
            found.points[self._balls] = self._centers + np.einsum("mij,mj->mi", self._maps, ways)
            found.values[self._balls] = product(self._centers, d) + lengths
        return found


def _points_of(of: ConvexSet) -> np.ndarray:
    return of.vertices if isinstance(of, VPolytope) else of.x  # type: ignore[attr-defined]


def _is_bounded_ball(of: ConvexSet) -> bool:
    return isinstance(of, AffineBall | Hyperellipsoid) and bool(np.isfinite(of._axes[1]).all())
