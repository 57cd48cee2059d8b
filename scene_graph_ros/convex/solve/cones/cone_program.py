"""Sparse programs over cones: variables, a linear cost, and affine rows that are in cones.

Points are checked by the caller, and bounds are computed from multipliers alone, for any values.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.convex.solve.cones.by_scip import ask_scip, MixedReply
from scene_graph_ros.convex.solve.cones.optimum import ConeSolution, optimum, Rows, TOLERANCES
from scene_graph_ros.convex.solve.cones.solver_choice import SolverChoice
from scene_graph_ros.convex.solve.cones.standard_form import Cone, StandardForm
from scene_graph_ros.convex.solve.linear_algebra.sparse_kernels import compress_columns

__all__ = ["Added", "Cone", "ConeProgram", "ConeSolution", "Rows"]


Entries = tuple[np.ndarray, np.ndarray, np.ndarray]
"""Rows, columns and values of entries, ``(k,)``."""


class Added(NamedTuple):
    """Rows of a program that were added together, and their entries: rows among these, columns."""

    rows: Rows
    entries: Sequence[Entries]
    constant: np.ndarray
    sizes: Sequence[int]
    """Rows of each cone, one behind another."""

    def joined(self) -> Entries:
        """Return all entries behind one another."""
        none = np.zeros(0, dtype=np.int64)
        i, j = (np.concatenate([none, *(each[k] for each in self.entries)]) for k in (0, 1))
        return i, j, np.concatenate([np.zeros(0), *(each[2] for each in self.entries)])


class ConeProgram:
    """Minimize ``cost . x`` where blocks of affine rows are in cones."""

    def __init__(self, size: int = 0) -> None:
        self._size = size
        self._costs: list[tuple[np.ndarray, np.ndarray]] = []
        self._counts = dict.fromkeys(Cone, 0)
        self.added: list[Added] = []

    def variables(self, count: int) -> np.ndarray:
        """Return the indices ``(count,)`` of new variables."""
        self._size += count
        return np.arange(self._size - count, self._size)

    def add_cost(self, columns: np.ndarray, values: np.ndarray) -> None:
        """Add ``values . x[columns]`` to the cost."""
        self._costs.append((columns, values))

    def bound_cost(self, most: float) -> None:
        """Ask that the cost is at most a number, and forget it as a cost."""
        entries = [(np.zeros(len(c), dtype=np.int64), c, -v) for c, v in self._costs]
        self.add_entries(Cone.NONNEGATIVE, entries, np.array([most]))
        self._costs.clear()

    def add_rows(
        self,
        cone: Cone,
        blocks: Sequence[tuple[np.ndarray, np.ndarray]],
        constant: np.ndarray,
    ) -> Rows:
        """Ask that ``sum of matrix @ x[columns] + constant`` is in a cone.

        ``blocks`` are columns ``(k,)`` and matrices ``(m, k)``; ``constant (m,)``.
        """
        entries = []
        for columns, matrix in blocks:
            i, j = np.nonzero(matrix)
            entries.append((i, columns[j], matrix[i, j]))
        return self.add_entries(cone, entries, constant)

    def add_entries(
        self,
        cone: Cone,
        entries: Sequence[Entries],
        constant: np.ndarray,
        sizes: Sequence[int] | None = None,
    ) -> Rows:
        """Ask for the same of rows given by entries: their rows, columns and values, ``(k,)``.

        They are in cones behind one another of so many rows, by default in one.
        """
        first, count = self._counts[cone], len(constant)
        rows = Rows(cone, first, count)
        if not count:
            return rows
        self.added.append(Added(rows, entries, constant, [count] if sizes is None else sizes))
        self._counts[cone] += count
        return rows

    @property
    def num_variables(self) -> int:
        """The number of variables."""
        return self._size

    @property
    def num_equations(self) -> int:
        """The number of rows that have to be zero: the first ones."""
        return self._counts[Cone.ZERO]

    @property
    def cost(self) -> np.ndarray:
        """The cost of each variable ``(n,)``."""
        q = np.zeros(self._size)
        for columns, values in self._costs:
            np.add.at(q, columns, values)
        return q

    def cost_of(self, x: np.ndarray) -> float:
        """Return the cost at a point ``(n,)``."""
        return sum(float(values @ x[columns]) for columns, values in self._costs)

    def form(self) -> StandardForm:
        """Return the program as solvers take it."""
        from scipy import sparse

        counts = dict(self._counts)
        sizes: dict[Cone, list[int]] = {c: [] for c in Cone if c > Cone.NONNEGATIVE}
        offsets = np.cumsum([0, *counts.values()])
        m = int(offsets[-1])
        # By kinds of cones; within one as they were added.
        added = sorted(self.added, key=lambda each: each.rows.cone)
        none = np.zeros(0, dtype=np.int64)
        entries = [(none, none, np.zeros(0))]  # a program may have no rows
        for each in added:
            first = each.rows.first + offsets[each.rows.cone]
            entries += [(i + first, j, v) for i, j, v in each.entries]
            if each.rows.cone in sizes:
                sizes[each.rows.cone] += each.sizes
        i, j, v = (np.concatenate([each[k] for each in entries]) for k in range(3))
        # Entries of one place add up, as columns may come several times.
        A = sparse.csc_matrix(compress_columns(i, j, -v, m, self._size), (m, self._size))
        b = np.concatenate([np.zeros(0), *(a.constant for a in added)])
        return StandardForm(A, b, self.cost, counts, sizes)

    def solve(
        self,
        what: str,
        *,
        is_rough: bool = False,
        by: SolverChoice | None = None,
        tolerance: float = TOLERANCES[0],
        is_over: Callable[[], bool] | None = None,
    ) -> ConeSolution:
        """Return the optimum, or that there is none, by the solver that is chosen.

        Raises SolverError, which names ``what`` was asked for, where neither was found;
        ``is_rough`` accepts larger residuals, and is asked for ``tolerance`` first, relative and
        absolute. Raises ConvexSetError for programs that the chosen solver does not solve, and for
        options that it has not, and StoppedError where ``is_over``, which Clarabel asks at each
        iteration, says so.
        """
        return optimum(self.form(), what, is_rough, by, tolerance, is_over)

    def solve_mixed_integer(self, binary: np.ndarray, what: str, by: SolverChoice) -> MixedReply:
        """Return the optimum where some variables ``(k,)`` are 0 or 1, as the solver says.

        Raises ConvexSetError for cones that it does not know.
        """
        form = self.form()
        unknown = [cone.name for cone in (Cone.SEMIDEFINITE, Cone.EXPONENTIAL) if form.sizes[cone]]
        if unknown:
            raise ConvexSetError(
                f"{what}: solver {by.name!r} knows rows and second-order cones, not {unknown[0]};"
                " leave the solver out"
            )
        return ask_scip(form, binary, by.options, what)
