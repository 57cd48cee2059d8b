"""A bounded set about its own centre, in variables of size 1, and how far it reaches."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import functools
import itertools

import numpy as np

from scene_graph_ros.convex.errors import SolverError
from scene_graph_ros.convex.graphs.expressions.packed_terms import (
    BOX,
    BY_CORNERS,
    OTHER,
    Packed,
    packed,
)
from scene_graph_ros.convex.graphs.model.lift_scaling import normalized, spread
from scene_graph_ros.convex.graphs.model.memberships import (
    add_memberships,
    Membership,
    membership_of_box,
)
from scene_graph_ros.convex.sets.affine_ball import AffineBall
from scene_graph_ros.convex.sets.cartesian_product import CartesianProduct
from scene_graph_ros.convex.sets.convex_set import ConvexSet
from scene_graph_ros.convex.sets.h_polyhedron import HPolyhedron
from scene_graph_ros.convex.sets.hyperellipsoid import Hyperellipsoid
from scene_graph_ros.convex.sets.hyperrectangle import Hyperrectangle
from scene_graph_ros.convex.sets.point import Point
from scene_graph_ros.convex.sets.v_polytope import VPolytope
from scene_graph_ros.convex.solve.cones.blocks import for_the_solver, upper_triangle
from scene_graph_ros.convex.solve.cones.cone_program import Cone, ConeProgram
from scene_graph_ros.convex.solve.cones.lift import Ball
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = ["PlacedMatrix", "PlacedSet", "nearest_of", "reach_of"]

_NO_EXTENT = 64.0 * EPSILON
"""Relative to the coordinates: a box this narrow is a point to rounding."""


@dataclass(frozen=True, eq=False)
class PlacedMatrix:
    """The upper triangle ``constant + factors * y[columns]`` of a matrix, column after column.

    It has no negative eigenvalue. All are ``(k,)``.
    """

    columns: np.ndarray
    factors: np.ndarray
    constant: np.ndarray

    def rows_at(self, y: np.ndarray) -> np.ndarray:
        """Return the upper triangle ``(k,)``."""
        return self.constant + self.factors * y[self.columns]


@dataclass(frozen=True, eq=False)
class PlacedSet:
    """All ``center + S y`` with ``E y = f``, ``A y <= b`` and some of y in balls and matrices.

    ``S`` is ``(n, k)``; y is of size 1 for any set. Every point is within ``half (n,)`` of
    the centre along each axis.
    """

    of: ConvexSet
    center: np.ndarray
    half: np.ndarray
    S: np.ndarray
    E: np.ndarray
    f: np.ndarray
    A: np.ndarray
    b: np.ndarray
    balls: tuple[Ball, ...] = ()
    parts: tuple[PlacedSet, ...] = ()
    """Of a product the sets, each in its own coordinates."""
    matrices: tuple[PlacedMatrix, ...] = ()

    @classmethod
    def place(cls, of: ConvexSet) -> PlacedSet:
        """Return a set, bounded and not empty, about the centre of its box."""
        if isinstance(of, Hyperellipsoid):
            return cls.place(AffineBall(of))
        if isinstance(of, CartesianProduct) and of.A is None and of.num_factors():
            return _product(of)
        if isinstance(of, HPolyhedron) and of.own_box is not None:
            return cls.place(Hyperrectangle(*of.own_box))
        low, high = _box(of)
        center, half = 0.5 * low + 0.5 * high, 0.5 * (high - low)
        # Wide enough for the rounding of the centre.
        half = half * (1.0 + 4.0 * EPSILON) + 2.0 * EPSILON * np.abs(center)
        extent = float(half.max(initial=0.0))
        if isinstance(of, Point) or extent <= _NO_EXTENT * np.abs(center).max(initial=0.0):
            return _placed(of, center, half, np.zeros((of.ambient_dimension, 0)))
        if isinstance(of, Hyperrectangle):
            wide = np.flatnonzero(half > _NO_EXTENT * extent)
            S = np.diag(half)[:, wide]
            A = np.concatenate([np.eye(len(wide)), -np.eye(len(wide))])
            return _placed(of, center, half, S, A=A, b=np.ones(2 * len(wide)))
        if isinstance(of, VPolytope):
            m = len(of.vertices)
            sums = (np.ones((1, m)), np.ones(1))
            S = (of.vertices - center).T
            return _placed(of, center, half, S, *sums, -np.eye(m), np.zeros(m))
        if isinstance(of, AffineBall):
            balls = (Ball(np.arange(of.B.shape[1])),)
            return _placed(of, center, half, of.B, balls=balls)
        return _from_lift(of, center, half, extent)

    @functools.cached_property
    def extent(self) -> float:
        """How far it reaches from the centre at most along an axis, 1 for a point."""
        return float(self.half.max(initial=0.0)) or 1.0

    @functools.cached_property
    def corners(self) -> np.ndarray | None:
        """The points ``(m, n)`` less the centre whose hull it is, where these are given."""
        vertices = self.of.vertices if isinstance(self.of, VPolytope) else None
        return None if vertices is None else vertices - self.center

    @functools.cached_property
    def is_box(self) -> bool:
        """Whether it is all of the box around it, or a point to rounding."""
        if self.parts:
            return False
        return not self.S.shape[1] or isinstance(self.of, Hyperrectangle)

    def reach(self, D: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return upper bounds ``(m,)`` of ``d . (x - center)`` for directions ``D (m, n)``.

        And of their rounding ``(m,)``, which isn't in them.
        """
        if self.parts:
            return self._reach_of_parts(D)
        sizes = np.abs(D) @ self.half
        rounding = 2.0 * (self.S.shape[0] + 4) * EPSILON
        if self.is_box:
            return sizes, rounding * sizes
        if self.corners is not None:
            return (D @ self.corners.T).max(axis=1), rounding * (
                sizes + np.abs(D) @ np.abs(self.center)
            )
        values = np.zeros(len(D))
        for k in np.flatnonzero(D.any(axis=1)):
            found = self.of.support(D[k])
            values[k] = found.value + found.gap
        offset = np.abs(D) @ np.abs(self.center) + np.abs(values)
        # A bound by the box is one, too, and the better one where the support is found badly.
        return np.minimum(values - D @ self.center, sizes), rounding * (offset + sizes)

    def _reach_of_parts(self, D: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the sums of the parts' supports, and of their rounding."""
        values, rounding, first = np.zeros(len(D)), np.zeros(len(D)), 0
        for part in self.parts:
            last = first + len(part.center)
            reach, off = part.reach(D[:, first:last])
            values, first = values + reach, last
            rounding += off + 2.0 * len(self.parts) * EPSILON * np.abs(reach)
        return values, rounding

    def add_membership(
        self, program: ConeProgram, y: np.ndarray, scale: np.ndarray | None
    ) -> None:
        """Ask that y is of the set, ``scale`` times as large if that is a variable's index."""
        add_memberships(program, [self.membership], y[:1], scale)

    @functools.cached_property
    def membership(self) -> tuple[Membership, ...]:
        """The membership of y; one object for all sets with the same one."""
        if isinstance(self.of, Hyperrectangle):
            return membership_of_box(self.S.shape[1])
        found = []
        for cone, matrix, side in (
            (Cone.ZERO, self.E, -self.f),
            (Cone.NONNEGATIVE, -self.A, self.b),
        ):
            if len(side):
                i, j = np.nonzero(matrix)
                found.append(Membership(cone, i, j, matrix[i, j], side))
        for ball in self.balls:
            k = len(ball.columns)
            rows = np.arange(1, k + 1)
            side = np.eye(k + 1)[0]
            found.append(
                Membership(Cone.SECOND_ORDER, rows, ball.columns, np.ones(k), side, ball.scale)
            )
        for each in self.matrices:
            block = (Cone.SEMIDEFINITE, each.columns, each.factors[:, None], each.constant)
            cone, columns, factors, side = for_the_solver(block)
            found.append(Membership(cone, np.arange(len(side)), columns, factors[:, 0], side))
        return tuple(found)

    @functools.cached_property
    def has_corners(self) -> bool:
        """Whether it is given by its least and greatest coordinates."""
        return isinstance(self.of, Point | Hyperrectangle)

    @functools.cached_property
    def packed(self) -> Packed:
        """Its arrays for kernels, without the matrices."""
        n, k = self.S.shape
        reach = BOX if self.is_box else BY_CORNERS if self.corners is not None else OTHER
        low, high = _box(self.of) if self.has_corners else (np.full(n, np.nan),) * 2
        head = [n, k, reach, len(self.f), len(self.b), len(self.balls)]
        balls = [[len(ball.columns), ball.scale, *ball.columns.tolist()] for ball in self.balls]
        arrays = [self.center, self.half, low, high, self.S, self.E, self.f, self.A, self.b]
        return packed(head, list(itertools.chain(*balls)), [each[None] for each in arrays])[0]

    @functools.cached_property
    def tells_reach(self) -> bool:
        """Whether the packed arrays tell how far it reaches."""
        return self.is_box or self.corners is not None

    def nearest(self, x: np.ndarray) -> tuple[np.ndarray | None, float]:
        """Return the nearest point of the set ``(n,)``, and how far x is outside.

        None where it is not found.
        """
        if isinstance(self.of, Point):
            return self.of.x, float(np.linalg.norm(self.of.x - x))
        try:
            nearest = self.of.projection(x[None])
        except SolverError:
            # Of sets that are put together: by how much each of them is missed.
            return None, float(self.of._outside(x[None])[0])
        assert nearest is not None, "sets of a graph are not empty"
        return nearest.points[0], float(nearest.distances[0])


def nearest_of(
    sets: Sequence[PlacedSet], points: Sequence[np.ndarray]
) -> list[tuple[np.ndarray | None, float]]:
    """Return the answer of `PlacedSet.nearest` for each set and point ``(n,)``."""
    boxes: dict[int, list[int]] = {}
    found: list[tuple[np.ndarray | None, float]] = [(None, 0.0)] * len(sets)
    for k, (placed, x) in enumerate(zip(sets, points, strict=True)):
        if isinstance(placed.of, Hyperrectangle):
            boxes.setdefault(len(x), []).append(k)
        else:
            found[k] = placed.nearest(x)
    for some in boxes.values():
        given = np.array([points[k] for k in some])
        low, high = (np.array([getattr(sets[k].of, b) for k in some]) for b in ("lb", "ub"))
        nearest = np.minimum(np.maximum(given, low), high)
        off = np.sqrt(np.sum((nearest - given) ** 2, axis=1)).tolist()
        for k, x, outside in zip(some, nearest, off, strict=True):
            found[k] = x, outside
    return found


def reach_of(
    sets: Sequence[PlacedSet], D: np.ndarray, half: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the reach of each set along its own direction, as `PlacedSet.reach`.

    ``D`` and ``half`` are ``(m, n)``.
    """
    sizes = np.sum(np.abs(D) * half, axis=1)
    values, rounding = sizes, 2.0 * (D.shape[1] + 4) * EPSILON * sizes
    others: dict[int, list[int]] = {}
    for k, placed in enumerate(sets):
        if not placed.is_box:
            others.setdefault(id(placed), []).append(k)
    for some in others.values():
        values[some], rounding[some] = sets[some[0]].reach(D[some])
    return values, rounding


def _box(of: ConvexSet) -> tuple[np.ndarray, np.ndarray]:
    """Return the least and greatest coordinates ``(n,)`` of a bounded set."""
    if isinstance(of, Point):
        return of.x, of.x
    if isinstance(of, Hyperrectangle):
        return of.lb, of.ub
    if isinstance(of, VPolytope):
        return of.vertices.min(axis=0), of.vertices.max(axis=0)
    if isinstance(of, AffineBall):
        reach = np.linalg.norm(of.B, axis=1)
        return of.center - reach, of.center + reach
    reached = [of.support(d) for e in np.eye(of.ambient_dimension) for d in (-e, e)]
    bounds = np.array([each.value + each.gap for each in reached])
    return -bounds[::2], bounds[1::2]


def _placed(
    of: ConvexSet,
    center: np.ndarray,
    half: np.ndarray,
    S: np.ndarray,
    E: np.ndarray | None = None,
    f: np.ndarray | None = None,
    A: np.ndarray | None = None,
    b: np.ndarray | None = None,
    balls: tuple[Ball, ...] = (),
) -> PlacedSet:
    """Return a set with some of the rows."""
    none, no_sides = np.zeros((0, S.shape[1])), np.zeros(0)
    return PlacedSet(
        of,
        center,
        half,
        S,
        none if E is None else E,
        no_sides if f is None else f,
        none if A is None else A,
        no_sides if b is None else b,
        balls,
    )


def _product(of: CartesianProduct) -> PlacedSet:
    """Return a product as the sets that it is made of, side by side."""
    factors = [of.factor(k) for k in range(of.num_factors())]
    different = {id(each): each for each in factors}
    placed = {number: PlacedSet.place(each) for number, each in different.items()}
    parts = tuple(placed[id(each)] for each in factors)
    firsts = np.cumsum([0, *(part.S.shape[1] for part in parts)]).tolist()
    balls = [
        Ball(ball.columns + first, ball.scale + first if ball.scale >= 0 else ball.scale)
        for part, first in zip(parts, firsts[:-1], strict=True)
        for ball in part.balls
    ]
    return PlacedSet(
        of,
        np.concatenate([part.center for part in parts]),
        np.concatenate([part.half for part in parts]),
        _side_by_side([part.S for part in parts]),
        _side_by_side([part.E for part in parts]),
        np.concatenate([part.f for part in parts]),
        _side_by_side([part.A for part in parts]),
        np.concatenate([part.b for part in parts]),
        tuple(balls),
        parts,
        tuple(
            PlacedMatrix(each.columns + first, each.factors, each.constant)
            for part, first in zip(parts, firsts[:-1], strict=True)
            for each in part.matrices
        ),
    )


def _side_by_side(blocks: list[np.ndarray]) -> np.ndarray:
    """Return a matrix with blocks along its diagonal."""
    result = np.zeros((sum(len(b) for b in blocks), sum(b.shape[1] for b in blocks)))
    row, column = 0, 0
    for block in blocks:
        result[row : row + len(block), column : column + block.shape[1]] = block
        row, column = row + len(block), column + block.shape[1]
    return result


def _from_lift(of: ConvexSet, center: np.ndarray, half: np.ndarray, extent: float) -> PlacedSet:
    """Return a set of any kind by its lift: further variables about those of one of its points."""
    lift, n = of.lifted, of.ambient_dimension
    at = np.array([float(v) for v in of.found.vector])
    at[:n] = center
    in_balls = [k for ball in lift.balls for k in (*ball.columns, ball.scale) if k >= 0]
    # Balls are about the origin, and of one size with their scale.
    at[in_balls] = 0.0
    sizes = np.full(lift.num_variables, np.nan)
    sizes[:n], sizes[in_balls] = extent, 1.0
    both = np.abs(np.concatenate([lift.E, lift.A]))
    spread(both, np.abs(np.append(lift.f - lift.E @ at, lift.b - lift.A @ at)), sizes)
    E, f = normalized(lift.E * sizes, lift.f - lift.E @ at)
    A, b = normalized(lift.A * sizes, lift.b - lift.A @ at)
    S = np.diag(sizes)[:n]
    matrices = []
    for each in lift.matrices:
        upper = each.columns[upper_triangle(len(each.columns))]
        size = float(max(np.abs(at[upper]).max(), sizes[upper].max())) or 1.0
        matrices.append(PlacedMatrix(upper, sizes[upper] / size, at[upper] / size))
    return PlacedSet(of, center, half, S, E, f, A, b, lift.balls, matrices=tuple(matrices))
