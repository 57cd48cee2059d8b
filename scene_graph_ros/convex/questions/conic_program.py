"""Small programs over cones: variables, rows, cones, a linear cost; sets add their own rows.

No modelling layer: variables are whole numbers, constraints are arrays. The program is brought to
a size of 1 by powers of two before it is solved (`solve.cone_program`), and the answer is
measured against the constraints as they were given.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
import math
from typing import Any

import numpy as np

from scene_graph_ros.convex.errors import ConvexSetError, SolverError
from scene_graph_ros.convex.questions.arguments import as_matrix, as_vector, as_whole
from scene_graph_ros.convex.solve.cones.blocks import (
    Block,
    for_the_solver,
    upper_triangle,
)
from scene_graph_ros.convex.solve.cones.cone_program import (
    Cone,
    ConeProgram,
    Rows,
)
from scene_graph_ros.convex.solve.cones.equilibration import equilibrated, widened
from scene_graph_ros.convex.solve.cones.solver_choice import as_choice
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.real_arrays import real_array

__all__ = ["Cone", "ConicConstraint", "ConicProgram", "ConicSolution", "rows_of_program"]

_MOST_VARIABLES, _MOST_ORDER = 100_000_000, 10_000
"""Of which numbers still fit in memory."""

_WIDENED = 1e-7
"""Relative to the size of a program: what has to be widened by more can't be fulfilled."""


@one_line()
@dataclass(frozen=True, eq=False)
class ConicConstraint:
    """``matrix @ x[variables] + constant`` is in a cone.

    ``variables (k,)``, ``matrix (m, k)``, ``constant (m,)``. Rows of a semidefinite matrix are its
    upper triangle, column after column.
    """

    cone: Cone
    variables: np.ndarray
    matrix: np.ndarray
    constant: np.ndarray

    @property
    def block(self) -> Block:
        """The same as a tuple."""
        return self.cone, self.variables, self.matrix, self.constant

    def rows_at(self, values: np.ndarray) -> np.ndarray:
        """Return the rows ``(m,)`` at values of all variables of the program."""
        return self.matrix @ values[self.variables] + self.constant

    def violation(self, values: np.ndarray) -> float:
        """Return by how much values of all variables break it, in the units of its rows, or 0.

        Of a second-order cone how much longer the others are than the first row, of a matrix
        how far its least eigenvalue is below 0.
        """
        rows = self.rows_at(values)
        if not len(rows):
            return 0.0
        if self.cone is Cone.ZERO:
            return float(np.abs(rows).max())
        if self.cone is Cone.NONNEGATIVE:
            return max(0.0, float(-rows.min()))
        if self.cone is Cone.SECOND_ORDER:
            return max(0.0, float(np.linalg.norm(rows[1:]) - rows[0]))
        if self.cone is Cone.SEMIDEFINITE:
            return max(0.0, float(-np.linalg.eigvalsh(matrix_of(rows))[0]))
        return _outside_exponential_cone(*rows.tolist())


@one_line()
@dataclass(frozen=True, eq=False)
class ConicSolution:
    """The values of all variables at the least cost, or that no values fulfil the constraints.

    ``values (n,)``, ``cost`` and ``gap`` are NaN for the latter. ``violation`` is the largest of
    all constraints at the values; ``gap`` by how much the cost may be above the least, as the
    multipliers have it: the remainder of them times rows, and of the cost's slope along the
    values. ``residual`` is that of the solver's equations, relative to the size of the program: of
    the proof where there are no values. `dual` has multipliers.
    """

    is_feasible: bool
    values: np.ndarray
    cost: float
    violation: float
    gap: float
    residual: float
    duals: dict[int, np.ndarray]

    def dual(self, constraint: ConicConstraint) -> np.ndarray:
        """Return the multipliers ``(m,)`` of a constraint's rows, to rounding of the solver.

        The cost less all multipliers times rows has its least value at the values. Raises
        ConvexSetError where there are no values, and for a constraint of another program.
        """
        if id(constraint) not in self.duals:
            raise ConvexSetError(
                "ConicSolution.dual: constraint must be one of a program that has a solution"
            )
        return self.duals[id(constraint)]

    def value(self, variables: Any) -> np.ndarray:
        """Return the values of some variables, in an array of their shape."""
        return self.values[np.asarray(variables)]


@one_line("num_variables")
class ConicProgram:
    """Minimize a linear cost of variables which rows and cones bound.

    ``x = program.add_variables(3)`` are numbers of variables ``(3,)``; parts of it, and arrays in
    any order, are as good. Sets add rows by ``add_point_in_set_constraints(program, x)``.
    """

    def __init__(self) -> None:
        self._program = ConeProgram()
        self._constraints: list[ConicConstraint] = []
        self._rows: list[Rows] = []

    @property
    def num_variables(self) -> int:
        """How many variables there are."""
        return self._program.num_variables

    @property
    def constraints(self) -> tuple[ConicConstraint, ...]:
        """All constraints, in the order in which they were added."""
        return tuple(self._constraints)

    def add_variables(self, count: int) -> np.ndarray:
        """Return the numbers ``(count,)`` of new variables. Raises ConvexSetError."""
        number = as_whole(count, "ConicProgram.add_variables: count", 0, _MOST_VARIABLES)
        return self._program.variables(number)

    def add_symmetric_matrix(self, order: int) -> np.ndarray:
        """Return the numbers ``(order, order)`` of new variables, the same beside the diagonal.

        They are numbered as in the upper triangle, column after column.
        """
        size = as_whole(order, "ConicProgram.add_symmetric_matrix: order", 0, _MOST_ORDER)
        numbers = self.add_variables(size * (size + 1) // 2)
        columns = np.zeros((size, size), dtype=np.int64)
        i, j = upper_triangle(size)
        columns[i, j] = columns[j, i] = numbers
        return columns

    def as_variables(self, value: Any, label: str, size: int | None = None) -> np.ndarray:
        """Return numbers of variables ``(size,)`` of the program. Raises ConvexSetError."""
        try:
            columns = np.atleast_1d(np.asarray(value))
        except ValueError:
            columns = np.array([np.nan])
        is_whole = columns.dtype.kind in "iu" or not columns.size
        if columns.ndim != 1 or not is_whole or (size is not None and len(columns) != size):
            wanted = "(k,)" if size is None else f"({size},)"
            raise ConvexSetError(
                f"{label} must be numbers of variables {wanted}, as add_variables returns them,"
                f" not {quoted(value)}"
            )
        columns = columns.astype(np.int64)
        if columns.size and (columns.min() < 0 or columns.max() >= self.num_variables):
            raise ConvexSetError(
                f"{label} must be variables of this program, which has {self.num_variables}, not"
                f" {columns.tolist()}"
            )
        return columns

    def add_linear_cost(self, c: Any, x: Any) -> None:
        """Add ``c . x`` to the cost, c ``(k,)``."""
        label = "ConicProgram.add_linear_cost"
        columns = self.as_variables(x, f"{label}: x")
        self._program.add_cost(columns, as_vector(c, f"{label}: c", len(columns)))

    def add_linear_equations(self, A: Any, b: Any, x: Any) -> ConicConstraint:
        """Ask that ``A x = b``: ``A (m, k)``, ``b (m,)``, ``x (k,)``."""
        A, b, x = self._linear(A, b, x, "add_linear_equations")
        return self._add(Cone.ZERO, A, -b, x)

    def add_linear_inequalities(self, A: Any, b: Any, x: Any) -> ConicConstraint:
        """Ask that ``A x <= b``: ``A (m, k)``, ``b (m,)``, ``x (k,)``."""
        A, b, x = self._linear(A, b, x, "add_linear_inequalities")
        return self._add(Cone.NONNEGATIVE, -A, b, x)

    def add_second_order_cone(self, A: Any, b: Any, x: Any) -> ConicConstraint:
        """Ask that the first row of ``A x + b`` is no shorter than all the others together."""
        A, b, x = self._linear(A, b, x, "add_second_order_cone")
        if not len(b):
            raise ConvexSetError("ConicProgram.add_second_order_cone: A must have at least a row")
        return self._add(Cone.SECOND_ORDER, A, b, x)

    def add_exponential_cone(self, A: Any, b: Any, x: Any) -> ConicConstraint:
        """Ask that the rows (u, v, w) of ``A x + b`` have ``v exp(u / v) <= w``, ``v >= 0``.

        For v = 0 that is ``u <= 0 <= w``.
        """
        A, b, x = self._linear(A, b, x, "add_exponential_cone")
        if len(b) != 3:
            raise ConvexSetError(
                f"ConicProgram.add_exponential_cone: A must have 3 rows, not {len(b)}"
            )
        return self._add(Cone.EXPONENTIAL, A, b, x)

    def add_positive_semidefinite(self, F: Any, x: Any) -> ConicConstraint:
        """Ask that ``F[0] + x[0] F[1] + x[1] F[2] + ...`` has no negative eigenvalue.

        ``F (k + 1, N, N)`` are symmetric matrices. For a matrix of variables of
        `add_symmetric_matrix`, `add_semidefinite_matrix` is shorter.
        """
        label = "ConicProgram.add_positive_semidefinite"
        columns = self.as_variables(x, f"{label}: x")
        matrices = as_symmetric(F, f"{label}: F", len(columns) + 1)
        rows = np.array([triangle_of(each) for each in matrices])
        return self._add(Cone.SEMIDEFINITE, rows[1:].T, rows[0], columns)

    def add_semidefinite_matrix(self, X: Any) -> ConicConstraint:
        """Ask that a matrix of variables ``(N, N)`` has no negative eigenvalue."""
        label = "ConicProgram.add_semidefinite_matrix"
        try:
            columns = np.asarray(X)
        except ValueError:
            columns = np.zeros(0)
        if columns.ndim != 2 or columns.shape != columns.T.shape or (columns != columns.T).any():
            raise ConvexSetError(f"{label}: X must be a symmetric matrix, not {quoted(X)}")
        i, j = upper_triangle(len(columns))
        upper = self.as_variables(columns[i, j], f"{label}: X")
        return self._add(Cone.SEMIDEFINITE, np.eye(len(upper)), np.zeros(len(upper)), upper)

    def _linear(self, A: Any, b: Any, x: Any, name: str) -> tuple[Any, Any, np.ndarray]:
        label = f"ConicProgram.{name}"
        columns = self.as_variables(x, f"{label}: x")
        matrix = as_matrix(A, f"{label}: A", len(columns))
        return matrix, as_vector(b, f"{label}: b", len(matrix)), columns

    def _add(
        self, cone: Cone, matrix: np.ndarray, constant: np.ndarray, columns: np.ndarray
    ) -> ConicConstraint:
        constraint = ConicConstraint(cone, columns, matrix, constant)
        self._constraints.append(constraint)
        _, columns, matrix, constant = for_the_solver(constraint.block)
        self._rows.append(self._program.add_rows(cone, [(columns, matrix)], constant))
        return constraint

    def add_constraint(
        self, cone: Cone, matrix: np.ndarray, constant: np.ndarray, x: Any
    ) -> ConicConstraint:
        """Ask that ``matrix @ x + constant`` is in a cone, in the words of `ConicConstraint`."""
        A, b, columns = self._linear(matrix, constant, x, "add_constraint")
        return self._add(Cone(cone), A, b, columns)

    def cost(self, values: np.ndarray) -> float:
        """Return the cost at values of all variables ``(n,)``."""
        return self._program.cost_of(values)

    def solve(
        self, solver: str | None = None, solver_options: Mapping[str, Any] | None = None
    ) -> ConicSolution:
        """Return values with the least cost, or that no values fulfil all constraints.

        The solver is "clarabel" by default, "highs" where all is linear, or "scs"; options are its
        own, by their names. Raises ConvexSetError for others.

        Where the solver finds neither, the least number is sought by which constraints have to be
        widened; if it is above rounding, there are no values. Raises SolverError where it is not,
        also where the cost has no least value.
        """
        by = as_choice(solver, solver_options, "ConicProgram.solve: solver")
        scaled = equilibrated(self._program)
        try:
            found = scaled.program.solve("ConicProgram.solve", by=by)
        except SolverError:
            least = widened(scaled.program).solve("ConicProgram.solve", by=by)
            if least.x[-1] <= _WIDENED:
                raise
            found = replace(least, is_feasible=False)
        if not found.is_feasible:
            nowhere = np.full(self.num_variables, np.nan)
            return ConicSolution(False, nowhere, math.nan, math.nan, math.nan, found.residual, {})
        values = scaled.sizes * found.x
        violation = max((c.violation(values) for c in self._constraints), default=0.0)
        duals = {}
        for constraint, rows in zip(self._constraints, self._rows, strict=True):
            dual = found.dual(rows) * scaled.factors[rows] if rows.size else np.zeros(0)
            duals[id(constraint)] = scaled.length * _for_the_rows(constraint.cone, dual)
        cost, gap = self.cost(values), self._gap(values, duals)
        return ConicSolution(True, values, cost, violation, gap, found.residual, duals)

    def _gap(self, values: np.ndarray, duals: Mapping[int, np.ndarray]) -> float:
        """Return by how much the cost at values may be above the least, by multipliers."""
        slope, left = self._program.cost, 0.0
        for each in self._constraints:
            dual = duals[id(each)]
            left += float(dual @ each.rows_at(values))
            np.subtract.at(slope, each.variables, each.matrix.T @ dual)
        return abs(left) + float(np.abs(slope) @ np.abs(values))


def _for_the_rows(cone: Cone, dual: np.ndarray) -> np.ndarray:
    """Return multipliers of a block for the solver as those of the rows that were given."""
    _, _, factors, _ = for_the_solver((cone, np.zeros(1), np.ones((len(dual), 1)), dual))
    return dual * factors[:, 0]


def rows_of_program(program: ConicProgram, kind: str) -> tuple[np.ndarray, np.ndarray]:
    """Return rows ``A x <= b`` of all variables; of an equation two. Raises ConvexSetError."""
    n = program.num_variables
    A, b = [np.zeros((0, n))], [np.zeros(0)]
    for constraint in program.constraints:
        if constraint.cone > Cone.NONNEGATIVE:
            raise ConvexSetError(
                f"{kind}: a program must have linear rows alone, not {constraint.cone.name}; a"
                " Spectrahedron may have matrices"
            )
        whole = np.zeros((len(constraint.constant), n))
        for k, column in zip(constraint.variables.tolist(), constraint.matrix.T, strict=True):
            whole[:, k] += column
        signs = (1.0, -1.0) if constraint.cone is Cone.ZERO else (1.0,)
        A += [-sign * whole for sign in signs]
        b += [sign * constraint.constant for sign in signs]
    return np.concatenate(A), np.concatenate(b)


def triangle_of(matrix: np.ndarray) -> np.ndarray:
    """Return a symmetric matrix ``(N, N)`` as rows of a semidefinite cone."""
    i, j = upper_triangle(len(matrix))
    return matrix[i, j]


def matrix_of(rows: np.ndarray) -> np.ndarray:
    """Return the symmetric matrix ``(N, N)`` of rows of a semidefinite cone."""
    order = math.isqrt(2 * len(rows))
    i, j = upper_triangle(order)
    matrix = np.zeros((order, order))
    matrix[i, j] = matrix[j, i] = rows
    return matrix


def as_symmetric(value: Any, label: str, count: int | None = None) -> np.ndarray:
    """Return symmetric matrices ``(count, N, N)`` of finite numbers. Raises ConvexSetError."""
    array = real_array(value, f"{label} must be matrices of numbers", ConvexSetError)
    shape = array.shape
    if array.ndim != 3 or shape[1] != shape[2] or (count is not None and len(array) != count):
        wanted = f"({'k' if count is None else count}, N, N)"
        raise ConvexSetError(f"{label} must have the shape {wanted}, not {shape}")
    flat = as_matrix(array.reshape(len(array), -1), label)
    matrices = flat.reshape(shape)
    off = np.flatnonzero((matrices != matrices.transpose(0, 2, 1)).any(axis=(1, 2)))
    if len(off):
        raise ConvexSetError(
            f"{label}[{off[0]}] must be symmetric, not {matrices[off[0]].tolist()}; take the mean"
            " of it and its transpose"
        )
    return matrices


def _outside_exponential_cone(u: float, v: float, w: float) -> float:
    if v <= 0.0:
        return max(-v, u, -w, 0.0)
    return max(0.0, v * math.exp(min(u / v, 700.0)) - w)
