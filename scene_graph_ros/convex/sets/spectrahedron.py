"""All points at which symmetric matrices, linear in them, have no negative eigenvalue."""

from __future__ import annotations

from collections.abc import Sized
from typing import Any

import numpy as np

from scene_graph_ros.convex.errors import ConvexSetError, SolverError
from scene_graph_ros.convex.questions.answers import Projection
from scene_graph_ros.convex.questions.arguments import as_matrix, as_vector
from scene_graph_ros.convex.questions.conic_program import (
    as_symmetric,
    ConicProgram,
    matrix_of,
)
from scene_graph_ros.convex.questions.generic import (
    check_gaps,
    is_near,
    nearest_in_form,
)
from scene_graph_ros.convex.sets.convex_set import ConvexSet
from scene_graph_ros.convex.solve.cones.cone_program import Cone
from scene_graph_ros.convex.solve.cones.lift import equations, joined, Lift, Semidefinite
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = ["Spectrahedron"]


class Spectrahedron(ConvexSet):
    """All x with ``F[0] + x_1 F[1] + ... + x_n F[n]`` semidefinite, ``A x <= b`` and ``E x = f``.

    ``Spectrahedron(F, A=, b=, E=, f=)`` takes symmetric matrices ``F (n + 1, N, N)``, or a list of
    such arrays, all of which hold; rows may be left out. ``Spectrahedron(program)`` is the
    feasible set of a `ConicProgram` of linear rows and matrices, in all its variables: of a whole
    symmetric matrix of variables the dimension is N (N + 1) / 2. Without arguments it is {0} in
    no dimensions.
    """

    def __init__(
        self, F: Any = (), *, A: Any = None, b: Any = None, E: Any = None, f: Any = None
    ) -> None:
        """Take matrices or a program. Raises ConvexSetError unless they fit."""
        if isinstance(F, ConicProgram):
            F, A, b, E, f = _of_program(F)
            n = A.shape[1]
        else:
            if isinstance(F, str | bytes):
                raise ConvexSetError(f"Spectrahedron: F must be matrices, not {quoted(F)}")
            is_several = isinstance(F, (list, tuple)) and bool(F) and _depth(F[0]) == 3
            given = F if is_several else [F]
            given = [each for each in given if _depth(each) or not isinstance(each, Sized)]
            F = tuple(
                as_symmetric(each, f"Spectrahedron: F{'' if len(given) == 1 else f'[{k}]'}")
                for k, each in enumerate(given)
            )
            n = len(F[0]) - 1 if F else 0
        for each in F:
            if len(each) != n + 1:
                raise ConvexSetError(
                    f"Spectrahedron: all arrays of F must have the length {n + 1}, one more than"
                    f" there are dimensions, not {[len(other) for other in F]}"
                )
        self._F: tuple[np.ndarray, ...] = tuple(F)
        self._A, self._b = _rows(A, b, n, "A", "b")
        self._E, self._f = _rows(E, f, n, "E", "f")
        super().__init__(n)

    @property
    def F(self) -> tuple[np.ndarray, ...]:
        """The matrices ``(n + 1, N, N)``: the constant one, then one for each coordinate."""
        return self._F

    @property
    def A(self) -> np.ndarray:
        """The rows ``(m, n)``."""
        return self._A

    @property
    def b(self) -> np.ndarray:
        """The right sides of the rows ``(m,)``."""
        return self._b

    @property
    def E(self) -> np.ndarray:
        """The equations ``(k, n)``."""
        return self._E

    @property
    def f(self) -> np.ndarray:
        """The right sides of the equations ``(k,)``."""
        return self._f

    def lift(self) -> Lift:
        """Return a matrix of variables M for each array, with ``M - x_1 F[1] - ... = F[0]``."""
        n = self.ambient_dimension
        counts = [F.shape[1] * (F.shape[1] + 1) // 2 for F in self._F]
        total = n + sum(counts)
        parts = [Lift(self._E, self._f, self._A, self._b).placed(np.arange(n), total)]
        first = n
        for F, count in zip(self._F, counts, strict=True):
            order = F.shape[1]
            i, j = np.triu_indices(order)
            columns = np.zeros((order, order), dtype=np.int64)
            columns[i, j] = columns[j, i] = np.arange(first, first + count)
            rows = np.zeros((count, total))
            rows[:, :n] = -F[1:, i, j].T
            rows[:, first : first + count] = np.eye(count)
            link = equations(rows, F[0, i, j])
            parts.append(Lift(link.E, link.f, link.A, link.b, (Semidefinite(columns),)))
            first += count
        return joined(parts)

    def _holds(self, points: np.ndarray) -> np.ndarray:
        """Return a mask of points with positive semidefinite matrices, to rounding, and rows."""
        inside = np.ones(len(points), dtype=bool)
        if not len(points):
            return inside
        reach = 4.0 * (self.ambient_dimension + 2) * EPSILON
        for A, b, is_equation in ((self._A, self._b, False), (self._E, self._f, True)):
            over = points @ A.T - b
            over = np.abs(over) if is_equation else over
            size = np.abs(points) @ np.abs(A).T + np.abs(b)
            inside &= (over <= reach * size).all(axis=1)
        for F in self._F:
            matrices = F[0] + np.tensordot(points, F[1:], axes=1)
            size = np.abs(F[0]).max(initial=0.0) + np.abs(points) @ np.abs(F[1:]).max(axis=(1, 2))
            inside &= np.linalg.eigvalsh(matrices)[:, 0] >= -reach * len(F[0]) * size
        return inside

    def _outside(self, points: np.ndarray) -> np.ndarray:
        inside = self._holds(points)
        distances = np.zeros(len(points))
        if not inside.all():
            found = self.projection(points[~inside])
            distances[~inside] = np.inf if found is None else found.distances
        return distances

    def _project(self, points: np.ndarray) -> Projection:
        nearest, gaps = points.copy(), np.zeros(len(points))
        for k in np.flatnonzero(~self._holds(points)):
            nearest[k], way = self._nearest(points[k])
            # The plane of the solver's multipliers, moved to where the set is proven to end.
            far = self.support(way)
            distance = float(np.linalg.norm(points[k] - nearest[k]))
            below = float(way @ points[k]) - far.value - far.gap
            gaps[k] = min(distance, max(0.0, distance - below))
            if not is_near(points[k], (distance, nearest[k], gaps[k])):
                # Along a way that rounding turned, an unbounded set has no end.
                _, nearest[k], gaps[k] = nearest_in_form(self, np.eye(len(way)), points[k])
        distances = np.linalg.norm(points - nearest, axis=1)
        check_gaps(self, points, nearest, distances, gaps)
        return Projection(distances, nearest, gaps)

    def _nearest(self, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the nearest point and the unit way ``(n,)`` from it, as the solver finds them."""
        n = self.ambient_dimension
        program = ConicProgram()
        # About the point itself, so that what is near to it loses nothing.
        step, distance = program.add_variables(n), program.add_variables(1)
        _centered_at(self, p).add_point_in_set_constraints(program, step)
        cone = program.add_second_order_cone(
            np.eye(n + 1), np.zeros(n + 1), np.concatenate([distance, step])
        )
        program.add_linear_cost([1.0], distance)
        solution = program.solve()
        if not solution.is_feasible:
            raise SolverError(
                f"Spectrahedron.projection: no nearest point to {p.tolist()} was found, though the"
                " set has a point; it may be thinner than the solver can tell"
            )
        way = solution.dual(cone)[1:]
        length = float(np.linalg.norm(way))
        return p + solution.value(step), way / length if length > 0.0 else way


def _centered_at(of: Spectrahedron, p: np.ndarray) -> Spectrahedron:
    """Return a spectrahedron less a point ``(n,)``, to rounding."""
    F = [np.concatenate([(F[0] + np.tensordot(p, F[1:], axes=1))[None], F[1:]]) for F in of.F]
    F = [0.5 * (each + each.transpose(0, 2, 1)) for each in F]
    n = of.ambient_dimension
    if not F:
        F = [np.zeros((n + 1, 0, 0))]
    return Spectrahedron(F, A=of.A, b=of.b - of.A @ p, E=of.E, f=of.f - of.E @ p)


def _rows(matrix: Any, side: Any, n: int, name: str, side_name: str) -> Any:
    if matrix is None and side is None:
        return as_matrix(np.zeros((0, n)), name), as_vector(np.zeros(0), side_name)
    if matrix is None or side is None:
        raise ConvexSetError(
            f"Spectrahedron: {name} and {side_name} belong together; give both or none"
        )
    rows = as_matrix(matrix, f"Spectrahedron: {name}", n)
    return rows, as_vector(side, f"Spectrahedron: {side_name}", len(rows))


def _of_program(program: ConicProgram) -> tuple[Any, ...]:
    """Return matrices, rows and equations of a program in all its variables."""
    n = program.num_variables
    F: list[np.ndarray] = []
    rows: dict[Cone, list[tuple[np.ndarray, np.ndarray]]] = {Cone.ZERO: [], Cone.NONNEGATIVE: []}
    for constraint in program.constraints:
        whole = np.zeros((len(constraint.constant), n))
        for k, column in zip(constraint.variables.tolist(), constraint.matrix.T, strict=True):
            whole[:, k] += column
        if constraint.cone is Cone.SEMIDEFINITE:
            F.append(np.array([matrix_of(each) for each in (constraint.constant, *whole.T)]))
        elif constraint.cone in rows:
            rows[constraint.cone].append((whole, constraint.constant))
        else:
            raise ConvexSetError(
                "Spectrahedron: a program must have linear rows and semidefinite matrices alone,"
                f" not {constraint.cone.name}; intersect the set with others instead"
            )
    of_each = []
    for found in rows.values():
        of_each.append(np.concatenate([np.zeros((0, n)), *(A for A, _ in found)]))
        of_each.append(np.concatenate([np.zeros(0), *(side for _, side in found)]))
    E, minus_f, minus_A, b = of_each
    return F, -minus_A, b, E, -minus_f


def _depth(value: Any) -> int:
    """Return the depth of nested lists, each the first of the one around it."""
    depth = 0
    while isinstance(value, (list, tuple)) and value:
        value, depth = value[0], depth + 1
    return depth + value.ndim * bool(value.size) if isinstance(value, np.ndarray) else depth
