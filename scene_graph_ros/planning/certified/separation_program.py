"""The program that looks for a plane between two geometries: sums of squares, with most clearance.

Each point's numerator is to be ``sum over rows of row(u) m(u)' G m(u)`` with semidefinite Gram
matrices G, a row each of the region, and m the monomials of the variables that move the point
(Putinar's certificate with multipliers of twice the degree 1 in each variable; Dai, Amice, Werner,
Zhang and Tedrake 2023, section IV). Both sides are compared monomial by monomial. The bound of the
plane's normal is one such identity between matrices, of degree 1.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.convex.solve.cones.cone_program import Cone, ConeProgram
from scene_graph_ros.convex.solve.cones.solver_choice import SolverChoice
from scene_graph_ros.planning.certified.monomials import triangle
from scene_graph_ros.planning.certified.pair_problem import HalfSpaceInE, PairProblem
from scene_graph_ros.planning.certified.pair_side import Side

__all__ = ["NORMAL_ROOM", "MovingRows", "SeparationProgram", "Solution"]

NORMAL_ROOM = 2.0**-16
"""How much shorter than 1 normals are kept, so that rounding has room."""

_NORMAL = 4
"""The order of the matrices that bound a normal."""


class Solution(NamedTuple):
    """A solver's answer: floats that prove nothing."""

    plane: NDArray[np.float64]
    """``(4, n + 1)``: the normal's coordinates and the offset, each affine, the constant first."""
    clearance: float
    """Metres, on each side of the plane."""
    normal_grams: NDArray[np.float64]
    """``(2 n + 1, 4, 4)``."""
    grams: tuple[NDArray[np.float64], ...]
    """Of each side ``(p, r, m, m)``: of each point a Gram matrix for each row."""
    chosen: tuple[NDArray[np.intp], NDArray[np.intp]] | None = None
    """Which of both sides' points have Gram matrices; all of them where this is None."""


class MovingRows(NamedTuple):
    """Rows of a region that are affine in variables of a program."""

    rows: tuple[tuple[tuple[tuple[int, float], ...], ...], ...]
    """Of each row the constant, then the factor of each u: columns with their factors."""
    grams: tuple[NDArray[np.float64], ...]
    """``(r, m, m)`` of each point: Gram matrices of these rows."""


Entries = tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.float64]]
"""Rows, columns and values."""


class SeparationProgram:
    """The program of one pair; several may share one `ConeProgram`."""

    def __init__(
        self,
        problem: PairProblem,
        program: ConeProgram | None = None,
        moving: MovingRows | None = None,
    ) -> None:
        """Add variables and conditions to a program, or to one of its own.

        With ``moving`` the region's rows are variables of the program, and their Gram matrices
        are given.
        """
        self.problem, self._moving = problem, moving
        self.program = ConeProgram() if program is None else program
        self._n = len(problem.variables)
        self._rows = [
            np.array([float(offset), *map(float, slopes)]) for offset, slopes in problem.all_rows
        ]
        if moving is not None:
            self._rows = self._rows[: 2 * self._n + 1]
        self.plane = self.program.variables(4 * (self._n + 1)).reshape(4, -1)
        (self.clearance,) = self.program.variables(1)
        self.normal_grams = self._grams(_NORMAL, 2 * self._n + 1)
        self._bound_normal()
        if problem.half_space is not None:
            self._stand_beside(problem.half_space)
        self.grams: list[list[NDArray[np.intp]]] = []
        self._number = 0
        for side in problem.sides:
            shared = _SideTerms(side, self._rows)
            points = side.numerators if len(side.hull.points) else ()
            self.grams.append([self._add_point(shared, point) for point in points])

    def maximize_clearance(self, by: SolverChoice | None = None) -> Solution:
        """Solve the program by itself, by the wall's solver or one that is chosen.

        Raises SolverError.
        """
        self.ask_for_clearance()
        found = self.program.solve(f"the plane between {self.problem.names}", by=by)
        return self.solution(found.x)

    def ask_for_clearance(self) -> None:
        """Have the clearance as large as it can be."""
        self.program.add_cost(np.array([self.clearance]), np.array([-1.0]))

    def keep_bounds(self, known: Solution) -> None:
        """Have the Gram matrices of the bounds' rows as a solution has them."""
        for side, grams in zip(self.grams, known.grams, strict=True):
            for columns, own in zip(side, grams, strict=True):
                i, j = triangle(own.shape[-1])
                chosen = columns[1 : 2 * self._n + 1].reshape(-1)
                values = own[1 : 2 * self._n + 1, i, j].reshape(-1)
                entries = np.arange(len(chosen)), chosen, np.ones(len(chosen))
                self.program.add_entries(Cone.ZERO, [entries], -values)

    def solution(self, x: NDArray[np.float64]) -> Solution:
        """Return this pair's part of a solution."""
        return Solution(
            x[self.plane],
            float(x[self.clearance]),
            _matrices(x[self.normal_grams]),
            tuple(np.array([_matrices(x[own]) for own in each]) for each in self.grams),
        )

    def _grams(self, order: int, count: int) -> NDArray[np.intp]:
        """Add ``count`` semidefinite matrices; return the columns of their upper triangles."""
        size = order * (order + 1) // 2
        columns = self.program.variables(count * size).reshape(count, size)
        if order == 1:
            entries = np.arange(count), columns[:, 0], np.ones(count)
            self.program.add_entries(Cone.NONNEGATIVE, [entries], np.zeros(count))
            return columns
        i, j = triangle(order)
        weights = np.where(i == j, 1.0, np.sqrt(2.0))
        for own in columns:
            entries = np.arange(size), own, weights
            self.program.add_entries(Cone.SEMIDEFINITE, [entries], np.zeros(size))
        return columns

    def _bound_normal(self) -> None:
        """Ask that ``[[1, a'], [a, 1]]`` is semidefinite in the region, with some room."""
        i, j = triangle(_NORMAL)
        size, entries = len(i), []
        for number, columns in enumerate(self.normal_grams):
            for k, factor in enumerate(self._rows[number]):
                if factor:
                    entries.append((k * size + np.arange(size), columns, np.full(size, factor)))
        in_first_row = np.flatnonzero((i == 0) & (j > 0))
        entries += [
            (k * size + in_first_row, self.plane[j[in_first_row] - 1, k], -np.ones(3))
            for k in range(self._n + 1)
        ]
        constant = np.zeros((self._n + 1) * size)
        constant[np.flatnonzero(i == j)] = -(1.0 - NORMAL_ROOM)
        self.program.add_entries(Cone.ZERO, entries, constant)

    def _stand_beside(self, half_space: HalfSpaceInE) -> None:
        """Have the plane parallel to a half space, beside it by the clearance."""
        wanted = np.array(half_space.plane(Fraction(0), self._n), dtype=np.float64).reshape(-1)
        columns = self.plane.reshape(-1)
        entries = [(np.arange(len(columns)), columns, np.ones(len(columns)))]
        # The offset's constant has the clearance in it.
        entries.append((np.array([3 * (self._n + 1)]), np.array([self.clearance]), np.ones(1)))
        self.program.add_entries(Cone.ZERO, entries, -wanted)

    def _add_point(self, terms: _SideTerms, point: NDArray[np.float64]) -> NDArray[np.intp]:
        """Add a point's identity, of numerators ``(4, q)``; return its matrices' columns."""
        monomials = terms.monomials
        columns = self._grams(len(monomials.basis), len(self._rows))
        i, own, values = terms.gram_entries
        entries = [(i, columns.reshape(-1)[own], -values)]
        for k, equations in enumerate(monomials.shift):
            for column, factors in zip(self.plane[:, k], point, strict=True):
                own = np.full(len(equations), column)
                entries.append((equations, own, terms.side.sign * factors))
        kept = terms.side.clearance(len(monomials.basis))
        kinds = np.flatnonzero(kept)
        entries.append((kinds, np.full(len(kinds), self.clearance), -kept[kinds]))
        constant = np.zeros(monomials.num_monomials)
        constant[monomials.shift[0]] = -terms.side.radius * point[3]
        if self._moving is not None:
            entries += self._entries_of_moving_rows(terms)
        self.program.add_entries(Cone.ZERO, entries, constant)
        return columns

    def _entries_of_moving_rows(self, terms: _SideTerms) -> list[Entries]:
        """Return the terms in the last point's equations of rows whose Gram matrices are given."""
        assert self._moving is not None
        grams = self._moving.grams[self._number]
        self._number += 1
        i, j = triangle(len(terms.monomials.basis))
        weights = np.where(i == j, 1.0, 2.0)
        return [
            (equations, np.full(len(i), column), -factor * weights * gram[i, j])
            for row, gram in zip(self._moving.rows, grams, strict=True)
            for equations, parts in zip(terms.products, row, strict=True)
            for column, factor in parts
        ]


class _SideTerms:
    """The terms of all points of one side: the Gram matrices' part of each monomial."""

    def __init__(self, side: Side, rows: Sequence[NDArray[np.float64]]) -> None:
        self.side, self.monomials, self._rows_of_region = side, side.monomials, rows
        i, j = triangle(len(self.monomials.basis))
        self.products = self.monomials.shift[:, self.monomials.base[i, j]]

    @cached_property
    def gram_entries(self) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.float64]]:
        """Equations, entries of the Gram matrices of all rows, and factors."""
        i, j = triangle(len(self.monomials.basis))
        size, weights = len(i), np.where(i == j, 1.0, 2.0)
        found = [
            (equations, number * size + np.arange(size), weights * row[k])
            for number, row in enumerate(self._rows_of_region)
            for k, equations in enumerate(self.products)
            if row[k]
        ]
        equations, entries, values = (np.concatenate(part) for part in zip(*found, strict=True))
        return equations, entries, values


def _matrices(triangles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return symmetric matrices ``(k, m, m)`` of upper triangles ``(k, m (m + 1) / 2)``."""
    order = int((np.sqrt(8 * triangles.shape[1] + 1) - 1) / 2)
    i, j = triangle(order)
    result = np.empty((len(triangles), order, order))
    result[:, i, j] = result[:, j, i] = triangles
    return result
