"""All points whose parts are in several sets, in their own coordinates or in others."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
import math
from typing import Any, Literal, overload

import numpy as np

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.convex.questions.answers import Projection, Support
from scene_graph_ros.convex.questions.arguments import as_matrix, as_vector
from scene_graph_ros.convex.questions.certificates import Decision
from scene_graph_ros.convex.sets.convex_set import ConvexSet
from scene_graph_ros.convex.sets.from_shapes import (
    cylinder_of,
    is_query,
    placed_shape,
)
from scene_graph_ros.convex.sets.h_polyhedron import HPolyhedron
from scene_graph_ros.convex.sets.hyperellipsoid import Hyperellipsoid
from scene_graph_ros.convex.sets.members import as_members, member
from scene_graph_ros.convex.solve.cones.lift import equations, joined, Lift
from scene_graph_ros.geometry.model.ids import GeometryId
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = ["CartesianProduct"]


def _is_map(sets: Any, other: Any) -> bool:
    """Tell whether sets come with a map A by position, and not with another set."""
    is_list = isinstance(sets, Sequence) and not isinstance(sets, (str, bytes))
    return is_list and not (other is None or isinstance(other, (ConvexSet, GeometryId)))


class CartesianProduct(ConvexSet):
    """All x with ``A x + b = (y_1, y_2, ...)`` and y_k in set k; without A and b, x is y.

    The tolerance of `point_in_set` is a distance of y. A map with more rows than columns leaves
    next to nothing of flat sets in floats: their product is then empty, exactly, and points are
    in it to a tolerance.

    ``CartesianProduct(sets)``, ``CartesianProduct(set, set)``, ``CartesianProduct(sets, A, b)``,
    and ``CartesianProduct(query, geometry_id, reference_frame=None)`` for a registered cylinder: a
    disc and a segment.
    """

    def __init__(
        self,
        sets: Any = (),
        other: Any = None,
        reference_frame: Any = None,
        *,
        A: Any = None,
        b: Any = None,
    ) -> None:
        """Take sets or a geometry. Raises ConvexSetError unless A has full column rank."""
        if is_query(sets):
            shape, X_FG = placed_shape(sets, other, reference_frame)
            radius, half = cylinder_of(shape, "CartesianProduct")
            disc = Hyperellipsoid.make_hypersphere(radius, np.zeros(2))
            self._factors: tuple[ConvexSet, ...] = (disc, HPolyhedron.make_box([-half], [half]))
            A, b = X_FG[:3, :3].T, -X_FG[:3, :3].T @ X_FG[:3, 3]
        else:
            if _is_map(sets, other):
                if A is not None:
                    raise ConvexSetError("CartesianProduct: A is given twice, also by its name")
                A, other = other, None
                b = reference_frame if b is None else b
            self._factors = as_members(sets, other, "CartesianProduct")
        inner = sum(factor.ambient_dimension for factor in self._factors)
        self._A, self._b = _map(A, b, inner)
        super().__init__(inner if self._A is None else self._A.shape[1])

    @property
    def A(self) -> np.ndarray | None:
        """The map ``(m, n)``, None where there is none."""
        return self._A

    @property
    def b(self) -> np.ndarray | None:
        """The offset ``(m,)``, None without one."""
        return self._b

    def num_factors(self) -> int:
        """Return the number of sets."""
        return len(self._factors)

    def factor(self, index: int) -> ConvexSet:
        """Return one of them. Raises ConvexSetError for a number without one."""
        return member(self._factors, index, "CartesianProduct.factor")

    @overload
    def is_empty(self, *, certificate: Literal[False] = ...) -> bool: ...

    @overload
    def is_empty(self, *, certificate: Literal[True]) -> Decision: ...

    def is_empty(self, *, certificate: bool = False) -> bool | Decision:
        """Tell whether one of the sets has no point; with its proof on request."""
        if certificate:
            return super().is_empty(certificate=True)
        return super().is_empty() if self._A is not None else any(self._of_each("is_empty"))

    @overload
    def is_bounded(self, *, certificate: Literal[False] = ...) -> bool: ...

    @overload
    def is_bounded(self, *, certificate: Literal[True]) -> Decision: ...

    def is_bounded(self, *, certificate: bool = False) -> bool | Decision:
        """Tell whether all of the sets are bounded, or one is empty; with its proof on request."""
        if certificate:
            return super().is_bounded(certificate=True)
        if self._A is not None:
            return super().is_bounded()
        return all(self._of_each("is_bounded")) or self.is_empty()

    def maybe_get_point(self) -> np.ndarray | None:
        """Return the points of all factors behind one another; None where a map is given."""
        found = [factor.maybe_get_point() for factor in self._factors]
        parts = [each for each in found if each is not None]
        if self._A is not None or not found or len(parts) < len(found):
            return super().maybe_get_point()
        return np.concatenate(parts)

    @property
    def has_exact_volume(self) -> bool:
        """Whether those of all factors are exact, and a map is square."""
        is_square = self._A is None or self._A.shape[0] == self._A.shape[1]
        return is_square and all(each.has_exact_volume for each in self._factors)

    def _volume(self) -> float:
        whole = math.prod(f.calc_volume() for f in self._factors if f.ambient_dimension)
        return whole if self._A is None else whole / abs(float(np.linalg.det(self._A)))

    def _of_each(self, question: str) -> Iterator[bool]:
        """Return the answers of each set; sets that come several times are asked once."""
        different = {id(factor): factor for factor in self._factors}.values()
        return (getattr(factor, question)() for factor in different)

    def lift(self) -> Lift:
        """Return the rows of each of its own part, after ``y - A x = b`` where there is a map."""
        n, lifts = self.ambient_dimension, [factor.lift() for factor in self._factors]
        inner = sum(factor.ambient_dimension for factor in self._factors)
        first = 0 if self._A is None else n
        rest = first + inner
        total = rest + sum(lift.num_variables for lift in lifts) - inner
        E, f = np.zeros((0, total)), np.zeros(0)
        if self._A is not None and self._b is not None:
            E, f = np.zeros((inner, total)), self._b
            E[:, :n], E[:, n:rest] = -self._A, np.eye(inner)
        placed = []
        for factor, lift in zip(self._factors, lifts, strict=True):
            k, extra = factor.ambient_dimension, lift.num_variables - factor.ambient_dimension
            columns = np.append(np.arange(first, first + k), np.arange(rest, rest + extra))
            placed.append(lift.placed(columns, total))
            first, rest = first + k, rest + extra
        return joined([equations(E, f), *placed])

    def _parts(self, x: np.ndarray) -> list[np.ndarray]:
        ends = np.cumsum([factor.ambient_dimension for factor in self._factors])
        return np.split(x, ends[:-1].astype(int), axis=-1) if len(ends) else []

    def _support(self, d: np.ndarray) -> Support:
        if self._A is not None and self._b is not None:
            if self._A.shape[0] > self._A.shape[1]:
                return super()._support(d)
            inverse = np.linalg.inv(self._A)
            value, y, gap = CartesianProduct(self._factors).support(d @ inverse)
            if value == np.inf:
                return Support(np.inf, inverse @ y, 0.0)
            x = inverse @ (y - self._b)
            return Support(float(d @ x), x, gap)
        reached = [f.support(part) for f, part in zip(self._factors, self._parts(d), strict=True)]
        if any(each.value == np.inf for each in reached):
            ways = [r.point * (r.value == np.inf) for r in reached]
            return Support(np.inf, np.concatenate(ways), 0.0)
        return Support(
            sum(each.value for each in reached),
            np.concatenate([np.zeros(0), *(each.point for each in reached)]),
            sum(each.gap for each in reached),
        )

    def _project(self, points: np.ndarray) -> Projection:
        if self._A is not None or not self._factors:
            return super()._project(points)
        found = [
            f._project(part) for f, part in zip(self._factors, self._parts(points), strict=True)
        ]
        return Projection(
            np.linalg.norm([each.distances for each in found], axis=0),
            np.concatenate([each.points for each in found], axis=1),
            np.linalg.norm([each.gaps for each in found], axis=0),
        )

    def _are_near(self, points: np.ndarray, tol: float) -> np.ndarray:
        parts = self._parts(self._mapped(points))
        near = np.ones(len(points), dtype=np.bool_)
        for factor, part in zip(self._factors, parts, strict=True):
            near &= factor._are_near(part, tol)
        unsure = np.flatnonzero(near & (self._outside(points) > 0.0))
        if len(unsure) and tol < np.inf:
            found = [
                f._project(part[unsure]) for f, part in zip(self._factors, parts, strict=True)
            ]
            distances = np.linalg.norm([each.distances for each in found], axis=0)
            gaps = np.linalg.norm([each.gaps for each in found], axis=0)
            near[unsure] = distances - gaps <= tol
        return near

    def _mapped(self, points: np.ndarray) -> np.ndarray:
        if self._A is None or self._b is None:
            return points
        y: np.ndarray = points @ self._A.T + self._b
        return y

    def _outside(self, points: np.ndarray) -> np.ndarray:
        if not self._factors:
            return np.zeros(len(points))
        parts = self._parts(self._mapped(points))
        each = [f._outside(part) for f, part in zip(self._factors, parts, strict=True)]
        return np.linalg.norm(each, axis=0)


def _map(A: Any, b: Any, inner: int) -> tuple[np.ndarray | None, np.ndarray | None]:
    if A is None and b is None:
        return None, None
    if A is None or b is None:
        raise ConvexSetError("CartesianProduct: A and b belong together; give both or none")
    matrix = as_matrix(A, "CartesianProduct: A")
    if len(matrix) != inner:
        raise ConvexSetError(
            f"CartesianProduct: A must have {inner} rows, one for each coordinate of the sets, not"
            f" {len(matrix)}"
        )
    values = np.linalg.svd(matrix, compute_uv=False)
    n = matrix.shape[1]
    if n > inner or (n and values[-1] <= inner * EPSILON * values[0]):
        raise ConvexSetError(
            f"CartesianProduct: A must have full column rank {n}; its singular values are"
            f" {values.tolist()}"
        )
    return matrix, as_vector(b, "CartesianProduct: b", inner)
