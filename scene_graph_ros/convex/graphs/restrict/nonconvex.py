"""Points of a path where costs and constraints are functions that need not be convex.

From the points of the convex program: by IPOPT where functions are written with operators, by
sequential quadratic programming (Kraft, "A software package for sequential quadratic programming",
1988, as SciPy has it) where they are somebody's own. What is found is the best nearby; points that
break anything are refused by who asks, and no bound comes of it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
import functools
import itertools
from typing import Any

import numpy as np

from scene_graph_ros.convex.errors import SolverError, StoppedError
from scene_graph_ros.convex.graphs.expressions.functions import FunctionConstraint, FunctionCost
from scene_graph_ros.convex.graphs.expressions.term_cones import kept_by
from scene_graph_ros.convex.graphs.model.edge_terms import EdgeTerms
from scene_graph_ros.convex.graphs.model.placed_set import PlacedMatrix, PlacedSet
from scene_graph_ros.convex.graphs.relax.relaxation import PlacedFunction, Problem
from scene_graph_ros.convex.graphs.restrict.smooth_path import is_smooth, smooth_program
from scene_graph_ros.convex.solve.cones.cone_program import Cone
from scene_graph_ros.convex.solve.nonlinear import Differentiable, minimize_nonlinear
from scene_graph_ros.convex.solve.smooth_program import SmoothProgram

__all__ = ["functions_at", "with_functions"]

_STEP = 6e-6
"""Of a set's size: the cube root of rounding, for differences to both sides."""


def functions_at(
    functions: Sequence[PlacedFunction], xu: np.ndarray, xv: np.ndarray
) -> tuple[float, float]:
    """Return the cost of functions at points, and their largest violation of bounds."""
    cost, worst = 0.0, 0.0
    for each in functions:
        value = each.at(xu, xv)
        if isinstance(each.term, FunctionCost):
            cost += value
        else:
            worst = max(worst, float(-value.min(initial=0.0)))
    return cost, worst


def with_functions(
    problem: Problem,
    path: Sequence[int],
    start: Sequence[np.ndarray],
    limit: float = np.inf,
) -> list[np.ndarray]:
    """Return points ``(n,)`` less their centres, near which none that keep all cost less.

    ``start`` are points of the sets. They are in the sets and keep what is convex to rounding of
    the solver, where it found such points. Where the first search ends far above ``limit``, no
    other one follows. Raises SolverError where no search ended at points that are a local optimum,
    and some keep all; StoppedError where it was ended before.
    """
    program, generator = _Program(problem, path), np.random.default_rng(0)
    best, least, idle = list(start), (True, np.inf, np.inf), 0
    # No points of these sets that keep what is convex cost less than the first ones.
    bound = program.cost(start)
    for trial, (away, is_near) in enumerate(_STARTS):
        if trial and problem.is_over is not None and problem.is_over():
            break
        if trial and least[0] and (away or not program.is_smooth):
            away = _BESIDE
        first = program.near(start, away, generator) if away else start
        found, is_optimal = program.solve(first, is_near, is_patient=least[0])
        worst = program.violation(found)
        rank = (not is_optimal, max(worst, _KEPT), program.cost(found))
        gain, same = least[2] - rank[2], _SAME * abs(bound)
        if rank < least:
            best, least = found, rank
        if least[0] or least[1] > _KEPT:
            continue
        idle = idle + 1 if gain <= same else 0
        above = (least[2] - bound) / (abs(bound) or 1.0)
        enough = next(count for count, most in _IDLE if above <= most)
        agrees = not rank[0] and rank[1] <= _KEPT and abs(gain) <= same
        if idle >= enough or agrees or not program.is_smooth or least[2] > limit * (1.0 + _LITTLE):
            break
    if least[0] and problem.is_over is not None and problem.is_over():
        raise StoppedError(
            "GraphOfConvexSets.solve_convex_restriction: the search was ended before it came to a"
            " local optimum"
        )
    if least[0] and least[1] <= _ACCEPTED:
        raise SolverError(
            f"GraphOfConvexSets.solve_convex_restriction: the points of a path of {len(path)}"
            f" edges keep all constraints, but none of {len(_STARTS)} searches ended at a local"
            " optimum"
        )
    return best


_BESIDE = 1e-4
_STARTS = ((0.0, True), (0.1, True), (0.0, False), (0.1, True), (0.4, False))
"""From how many starts the best is taken at most; where functions are somebody's own, the first of
these that leads to a local optimum. Each is away from the convex program's points by a part of the
half widths of sets, and is searched near itself or farther. Starts are just beside while no search
ended well, as one that is lost from one point may end well from the next."""

_SAME, _LITTLE = 1e-3, 1e-2
"""Of a lower bound: what a start has to gain at least; of a limit, by how much a first search may
end above it for others to follow."""

_IDLE = ((0, 3e-2), (1, 0.1), (2, np.inf))
"""So many starts in succession that gain nothing end the search, for a cost that is at most so
far above a lower bound, as a part of it; and one that ends at the same cost."""

_KEPT, _ACCEPTED = 1e-8, 1e-7
"""By how much points may break something for a search to end, and to be kept at all."""


class _Program:
    """Variables of all sets behind one another, and their constraints."""

    def __init__(self, problem: Problem, path: Sequence[int]) -> None:
        network = problem.network
        vertices = [network.source, *(int(network.heads[e]) for e in path)]
        self._problem, self._path = problem, path
        self._sets = [problem.sets[v] for v in vertices]
        ends = np.cumsum([0, *(placed.S.shape[1] for placed in self._sets)]).tolist()
        self._slices = [slice(a, b) for a, b in itertools.pairwise(ends)]
        self._count = ends[-1]
        self.is_smooth = is_smooth(problem, path, self._sets)

    def solve(
        self, start: Sequence[np.ndarray], is_near: bool, is_patient: bool
    ) -> tuple[list[np.ndarray], bool]:
        """Solve from points; return others less their centres, and whether they are optimal."""
        first = np.zeros(self._count)
        for placed, at, x in zip(self._sets, self._slices, start, strict=True):
            first[at] = _variables_at(placed, x)
        if self.is_smooth:
            y, is_optimal = self._smooth.solve(first, is_near=is_near, is_patient=is_patient)
        else:
            y, is_optimal = self._by_squares(first)
        parts = zip(self._sets, self._slices, strict=True)
        return [placed.S @ y[at] for placed, at in parts], is_optimal

    @functools.cached_property
    def _smooth(self) -> SmoothProgram:
        return smooth_program(self._problem, self._path, self._sets, self._slices)

    def _by_squares(self, first: np.ndarray) -> tuple[np.ndarray, bool]:
        """Return variables by sequential least squares."""
        equal, least = self._of_sets()
        for k, e in enumerate(self._path):
            self._of_terms(k, self._problem.terms[e], equal, least)
            for each in self._problem.functions.get(e, ()):
                if isinstance(each.term, FunctionConstraint):
                    equations, others = _split(self._differences(k, each), each.term)
                    equal += equations
                    least += others
        return minimize_nonlinear(self._cost, first, equal, least)

    def cost(self, points: Sequence[np.ndarray]) -> float:
        """Return the cost at points less their centres."""
        total = 0.0
        for k, e in enumerate(self._path):
            u, v = (self._sets[j].center + points[j] for j in (k, k + 1))
            total += self._problem.terms[e].cost(points[k], points[k + 1])
            total += functions_at(self._problem.functions.get(e, ()), u, v)[0]
        return total

    def near(
        self, points: Sequence[np.ndarray], share: float, generator: np.random.Generator
    ) -> list[np.ndarray]:
        """Return other points of the sets, less their centres, by a share of half widths away."""
        moved = []
        for placed, x in zip(self._sets, points, strict=True):
            away = x + share * placed.half * generator.normal(size=len(x))
            nearest = placed.of.projection((placed.center + away)[None])
            assert nearest is not None, "sets of a graph are not empty"
            moved.append(nearest.points[0] - placed.center)
        return moved

    def violation(self, points: Sequence[np.ndarray]) -> float:
        """Return by how much points less their centres break an edge's constraints."""
        worst = 0.0
        for k, e in enumerate(self._path):
            xu, xv = points[k], points[k + 1]
            u, v = self._sets[k].center + xu, self._sets[k + 1].center + xv
            broken = functions_at(self._problem.functions.get(e, ()), u, v)[1]
            worst = max(worst, broken, self._problem.terms[e].violation(xu, xv))
        return worst

    def _points(self, y: np.ndarray, k: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the points of the k-th edge less their centres."""
        xu, xv = (self._sets[j].S @ y[self._slices[j]] for j in (k, k + 1))
        return xu, xv

    def _cost(self, y: np.ndarray) -> tuple[float, np.ndarray]:
        """Return the cost in units, and its gradient."""
        total, gradient, unit = 0.0, np.zeros(self._count), self._problem.unit
        for k, e in enumerate(self._path):
            terms, points = self._problem.terms[e], self._points(y, k)
            total += terms.cost(*points)
            self._add(gradient, k, *terms.gradient(*points))
            for each in self._problem.functions.get(e, ()):
                if isinstance(each.term, FunctionCost):
                    value, slope = self._differences(k, each)(y)
                    total += float(value[0])
                    gradient += slope[0]
        return total / unit, gradient / unit

    def _add(self, row: np.ndarray, k: int, along_u: np.ndarray, along_v: np.ndarray) -> None:
        for j, along in ((k, along_u), (k + 1, along_v)):
            row[self._slices[j]] += along @ self._sets[j].S

    def _of_sets(self) -> tuple[list[Differentiable], list[Differentiable]]:
        """Return the constraints of sets: equations, and values to be at least 0."""
        equal: list[Differentiable] = []
        least: list[Differentiable] = []
        for placed, at in zip(self._sets, self._slices, strict=True):
            for found, rows, sides in (
                (equal, placed.E, placed.f),
                (least, -placed.A, -placed.b),
            ):
                if len(rows):
                    found.append(_linear(rows, sides, at, self._count))
            for ball in placed.balls:
                columns = np.arange(at.start, at.stop)
                scale = -1 if ball.scale < 0 else int(columns[ball.scale])
                least.append(_ball(columns[ball.columns], scale, self._count))
            least += [_matrix(each, at.start, self._count) for each in placed.matrices]
        return equal, least

    def _of_terms(
        self,
        k: int,
        terms: EdgeTerms,
        equal: list[Differentiable],
        least: list[Differentiable],
    ) -> None:
        """Add an edge's own convex constraints."""
        sizes = terms.row_sizes
        split = len(terms.equations.m)
        for found, part, sign, size in (
            (equal, terms.equations, 1.0, sizes[:split]),
            (least, terms.inequalities, -1.0, sizes[split:]),
        ):
            if len(part.m):
                factor = sign / size[:, None]
                found.append(
                    self._part(k, factor * part.Mu, factor * part.Mv, factor[:, 0] * part.m)
                )
        for cone, part in zip(terms.layout.cone_kinds, terms.cones, strict=True):
            rows = self._part(k, part.Mu, part.Mv, part.m)
            least.append(_cone_of(cone, rows))

    def _part(self, k: int, Mu: np.ndarray, Mv: np.ndarray, m: np.ndarray) -> Differentiable:
        matrix = np.zeros((len(m), self._count))
        for j, part in ((k, Mu), (k + 1, Mv)):
            matrix[:, self._slices[j]] += part @ self._sets[j].S
        return lambda y: (matrix @ y + m, matrix)

    def _differences(self, k: int, function: PlacedFunction) -> Differentiable:
        """Return a function's value ``(m,)`` and slopes ``(m, count)``, by differences."""

        def value(y: np.ndarray) -> np.ndarray:
            xu, xv = self._points(y, k)
            u, v = self._sets[k].center + xu, self._sets[k + 1].center + xv
            return np.atleast_1d(function.at(u, v))

        def both(y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            here = value(y)
            slopes = np.zeros((len(here), self._count))
            ends = [j for j, takes in ((k, function.takes_u), (k + 1, function.takes_v)) if takes]
            for i in [i for j in ends for i in range(*self._slices[j].indices(self._count))]:
                step = np.zeros(self._count)
                step[i] = _STEP
                slopes[:, i] = (value(y + step) - value(y - step)) / (2.0 * _STEP)
            return here, slopes

        return both


def _split(
    both: Differentiable, of: FunctionConstraint
) -> tuple[list[Differentiable], list[Differentiable]]:
    """Return a function's equations, and the rows of its other bounds.

    Two inequalities in place of an equation would leave no inner point.
    """
    is_finite = np.isfinite(np.concatenate([of.lower, of.upper]))
    is_equal = of.lower == of.upper
    equations = np.concatenate([is_equal, np.zeros_like(is_equal)])[is_finite]
    others = ~np.concatenate([is_equal, is_equal])[is_finite]
    return _rows_of(both, equations), _rows_of(both, others)


def _rows_of(both: Differentiable, rows: np.ndarray) -> list[Differentiable]:
    """Return some rows of a function; nothing where there are none."""

    def chosen(y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        values, slopes = both(y)
        return values[rows], slopes[rows]

    return [chosen] if rows.any() else []


def _variables_at(placed: PlacedSet, x: np.ndarray) -> np.ndarray:
    """Return variables of a set for a point less the centre: where they do it least violence."""
    return np.linalg.lstsq(np.concatenate([placed.S, placed.E]), np.concatenate([x, placed.f]))[0]


def _linear(rows: np.ndarray, sides: np.ndarray, at: slice, count: int) -> Differentiable:
    matrix = np.zeros((len(rows), count))
    matrix[:, at] = rows
    return lambda y: (matrix @ y - sides, matrix)


def _ball(columns: np.ndarray, scale: int, count: int) -> Differentiable:
    """Return ``s^2 - |y|^2`` and s, of which both are to be at least 0."""

    def both(y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        s = 1.0 if scale < 0 else float(y[scale])
        slopes = np.zeros((2, count))
        slopes[0, columns] = -2.0 * y[columns]
        if scale >= 0:
            slopes[:, scale] = 2.0 * s, 1.0
        return np.array([s * s - y[columns] @ y[columns], s]), slopes

    return both


def _matrix(of: PlacedMatrix, first: int, count: int) -> Differentiable:
    """Return eigenvalues, which are to be at least 0, and their slopes."""

    def both(y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        values, along = kept_by(Cone.SEMIDEFINITE, of.rows_at(y[first:]))
        slopes = np.zeros((len(values), count))
        slopes[:, first + of.columns] = along * of.factors
        return values, slopes

    return both


def _cone_of(cone: Cone, rows: Callable[[np.ndarray], tuple[np.ndarray, Any]]) -> Differentiable:
    """Return values of rows that are at least 0 in a cone, and their slopes by variables."""

    def both(y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        w, matrix = rows(y)
        values, slopes = kept_by(cone, w)
        return values, slopes @ matrix

    return both
