"""A path's program as smooth functions, where its constraints are written with operators."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from scene_graph_ros.convex.graphs.expressions.functions import PointProduct, WrittenConstraint
from scene_graph_ros.convex.graphs.model.edge_terms import Part
from scene_graph_ros.convex.graphs.model.placed_set import PlacedSet
from scene_graph_ros.convex.graphs.relax.relaxation import PlacedFunction, Problem
from scene_graph_ros.convex.solve.cones.cone_program import Cone
from scene_graph_ros.convex.solve.products import Product
from scene_graph_ros.convex.solve.smooth_program import has_ipopt, SmoothProgram

__all__ = ["is_smooth", "smooth_program"]


def is_smooth(problem: Problem, path: Sequence[int], sets: Sequence[PlacedSet]) -> bool:
    """Tell whether IPOPT is there and knows all that a path's edges and sets ask and cost."""
    functions = [each for e in path for each in problem.functions.get(e, ())]
    cones = {cone for e in path for cone in problem.terms[e].layout.cone_kinds}
    return (
        all(isinstance(each.term, WrittenConstraint) for each in functions)
        and not any(placed.matrices for placed in sets)
        and Cone.SEMIDEFINITE not in cones
        and has_ipopt()
    )


def smooth_program(
    problem: Problem, path: Sequence[int], sets: Sequence[PlacedSet], slices: Sequence[slice]
) -> SmoothProgram:
    """Return the program of the variables of all sets, each in its slice."""
    made = _Made(problem, sets, slices)
    for k in range(len(sets)):
        made.add_set(k)
    for k, e in enumerate(path):
        made.add_terms(k, e)
        for each in problem.functions.get(e, ()):
            made.add_function(k, each)
    return made.program


class _Made:
    def __init__(
        self, problem: Problem, sets: Sequence[PlacedSet], slices: Sequence[slice]
    ) -> None:
        self._problem, self._sets, self._slices = problem, sets, slices
        self._count = slices[-1].stop
        self._points: dict[int, Any] = {}
        self.program = SmoothProgram(self._count, problem.is_over)

    def add_set(self, k: int) -> None:
        """Ask that variables are of the k-th set."""
        placed, program = self._sets[k], self.program
        program.add_equations(self._columns(k, placed.E), -placed.f)
        program.add_least(self._columns(k, -placed.A), placed.b)
        for ball in placed.balls:
            M, m = np.zeros((len(ball.columns) + 1, placed.S.shape[1])), np.zeros(0)
            m = np.eye(len(M))[0] * (ball.scale < 0)
            M[np.arange(1, len(M)), ball.columns] = 1.0
            if ball.scale >= 0:
                M[0, ball.scale] = 1.0
            program.add_cone(Cone.SECOND_ORDER, self._columns(k, M), m)

    def add_terms(self, k: int, e: int) -> None:
        """Add the cost and the convex constraints of the edge from the k-th set."""
        terms, program, unit = self._problem.terms[e], self.program, self._problem.unit
        for kind, part, rows in terms.costs():
            size = float(np.linalg.norm(terms.most[rows])) or 1.0
            program.add_cost(kind, self._rows(k, part), part.m, unit, size)
        sizes, split = terms.row_sizes, len(terms.equations.m)
        for part, size, add, sign in (
            (terms.equations, sizes[:split], program.add_equations, 1.0),
            (terms.inequalities, sizes[split:], program.add_least, -1.0),
        ):
            add(sign * self._rows(k, part) / size[:, None], sign * part.m / size)
        for cone, part in zip(terms.layout.cone_kinds, terms.cones, strict=True):
            program.add_cone(cone, self._rows(k, part), part.m)

    def add_function(self, k: int, function: PlacedFunction) -> None:
        """Ask what a function does of the edge from the k-th set."""
        ends = [j for j, takes in ((k, function.takes_u), (k + 1, function.takes_v)) if takes]
        term = function.term
        assert isinstance(term, WrittenConstraint), "is_smooth"
        products = tuple(self._product(ends, each) for each in term.products)
        self.program.add_products(
            products, term.is_equal, lambda: term.function(*(self._point(j) for j in ends))
        )

    def _product(self, ends: Sequence[int], product: PointProduct) -> Product:
        """Return a product of points of sets as one of all variables."""
        of, base = ends[product.of], ends[product.base]
        set_of, set_base = self._sets[of], self._sets[base]
        k = len(product.constant)
        return Product(
            self._columns(of, product.rows @ set_of.S),
            product.rows @ set_of.center + product.constant,
            np.ones((k, 1)),
            self._columns(base, set_base.S[-1:]),
            set_base.center[-1:],
            product.power,
        )

    def _point(self, k: int) -> Any:
        """Return the point of the k-th set as an expression."""
        if k not in self._points:
            placed = self._sets[k]
            self._points[k] = self.program.at(self._columns(k, placed.S), placed.center)
        return self._points[k]

    def _columns(self, k: int, rows: np.ndarray) -> np.ndarray:
        """Return rows of the k-th set's variables as rows of all."""
        result = np.zeros((len(rows), self._count))
        result[:, self._slices[k]] = rows
        return result

    def _rows(self, k: int, part: Part) -> np.ndarray:
        """Return a part of the edge from the k-th set as rows of all variables."""
        ends = ((k, part.Mu), (k + 1, part.Mv))
        result: np.ndarray = sum(
            (self._columns(j, each @ self._sets[j].S) for j, each in ends),
            np.zeros((len(part.m), self._count)),
        )
        return result
