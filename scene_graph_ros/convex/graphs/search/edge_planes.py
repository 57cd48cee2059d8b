"""A polyhedron around the two points of an edge, from its sets, costs and constraints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import functools
import math

import numpy as np

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.convex.graphs.expressions.expressions import Affine, Atom, Constraint, Cost
from scene_graph_ros.convex.graphs.model.edge import Edge
from scene_graph_ros.convex.questions.conic_program import matrix_of
from scene_graph_ros.convex.sets.h_polyhedron import HPolyhedron
from scene_graph_ros.convex.solve.cones.cone_program import Cone
from scene_graph_ros.convex.solve.cones.lift import Lift

__all__ = ["EdgePlanes"]

_NEGATIVE = 1e-12
"""Relative to the terms of a cost: how far below 0 rounding may take its least value."""

_TANGENTS = (0.1, 1.0, 10.0)
"""Where curved costs have planes beneath them, beside what fits the limit."""

Rows = list[tuple[np.ndarray, float]]
"""Rows ``(N,)`` and right sides of inequalities, at most."""


class EdgePlanes:
    """The polyhedron, as far as boxes around the two sets don't say more.

    Variables are the lifts of both sets behind one another, then one for each convex function of
    the cost, which is beneath it.
    """

    def __init__(
        self, edge: Edge, costs: Sequence[Cost], constraints: Sequence[Constraint], limit: float
    ) -> None:
        self.edge, self._costs, self._limit = edge, costs, limit
        self._lifts = [edge.u.set.lifted, edge.v.set.lifted]
        self._firsts = {edge.u.id: 0, edge.v.id: self._lifts[0].num_variables}
        self._atoms = [atom for cost in costs for atom in cost.atoms]
        self._first_atom = sum(lift.num_variables for lift in self._lifts)
        self._size = self._first_atom + len(self._atoms)
        self._constraints = constraints

    @functools.cached_property
    def _of_sets(self) -> Rows:
        """Return rows of sets and constraints."""
        rows: Rows = []
        for lift, first in zip(self._lifts, self._firsts.values(), strict=True):
            rows += self._of_lift(lift, first)
        for each in self._constraints:
            rows += self._of_constraint(each)
        return rows

    @functools.cached_property
    def _all(self) -> Rows:
        """Return rows of sets, constraints and of the cost up to the limit."""
        rows = list(self._of_sets)
        if not self._limit < math.inf:
            return rows
        for k, atom in enumerate(self._atoms):
            rows += self._beneath(atom, self._first_atom + k)
        total, constant = self._cost
        return [*rows, (total, self._limit - constant)]

    @functools.cached_property
    def _cost(self) -> tuple[np.ndarray, float]:
        """Return the cost as a row and a constant, with minorants of its convex functions."""
        row, constant = np.zeros(self._size), 0.0
        row[self._first_atom :] = 1.0
        for cost in self._costs:
            M, m = self._matrix(cost.rest)
            row, constant = row + M[0], constant + float(m[0])
        return row, constant

    def _matrix(self, of: Affine) -> tuple[np.ndarray, np.ndarray]:
        matrix = np.zeros((len(of), self._size))
        for number, each in of.terms.items():
            first = self._firsts[number]
            matrix[:, first : first + each.shape[1]] += each
        return matrix, of.constant

    def _of_lift(self, lift: Lift, first: int) -> Rows:
        rows: Rows = []
        last = first + lift.num_variables
        for matrix, side, signs in ((lift.E, lift.f, (1.0, -1.0)), (lift.A, lift.b, (1.0,))):
            for row, value in zip(matrix, side.tolist(), strict=True):
                for sign in signs:
                    whole = np.zeros(self._size)
                    whole[first:last] = sign * row
                    rows.append((whole, sign * value))
        for ball in lift.balls:
            for column in ball.columns.tolist():
                for sign in (1.0, -1.0):
                    whole = np.zeros(self._size)
                    whole[first + column] = sign
                    if ball.scale >= 0:
                        whole[first + ball.scale] -= 1.0
                    rows.append((whole, 0.0 if ball.scale >= 0 else 1.0))
        for block in lift.matrices:
            order = len(block.columns)
            for i in range(order):
                whole = np.zeros(self._size)
                whole[first + block.columns[i, i]] = -1.0
                rows.append((whole, 0.0))
        return rows

    def _of_constraint(self, of: Constraint) -> Rows:
        M, m = self._matrix(of.rows)
        if of.cone is None:
            signs = (1.0, -1.0) if of.is_equation else (1.0,)
            return [(s * row, -s * c) for row, c in zip(M, m.tolist(), strict=True) for s in signs]
        if of.cone is Cone.SECOND_ORDER:
            return [
                (s * row - M[0], float(m[0] - s * c))
                for row, c in zip(M[1:], m[1:].tolist(), strict=True)
                for s in (1.0, -1.0)
            ]
        if of.cone is Cone.SEMIDEFINITE:
            places = matrix_of(np.arange(len(m), dtype=np.float64)).astype(int)
            return [(-M[k], float(m[k])) for k in np.diag(places)]
        # w >= v exp(u / v) >= v + u, as v exp(a) (1 + u / v - a) is beneath for each a.
        return [(-M[1], float(m[1])), (M[0] + M[1] - M[2], float(m[2] - m[0] - m[1]))]

    def _beneath(self, atom: Atom, column: int) -> Rows:
        """Return rows that keep a variable above planes beneath a convex function."""
        M, m = self._matrix(atom.of)
        t = np.eye(self._size)[column]
        rows: Rows = [(-t, 0.0)]
        if atom.kind == "exponential":
            points = (0.0, math.log(max(self._limit, 1e-300)))
            return rows + [
                (math.exp(a) * M[0] - t, -math.exp(a) * (1.0 - a + float(m[0]))) for a in points
            ]
        both = [
            (s * row, s * c) for row, c in zip(M, m.tolist(), strict=True) for s in (1.0, -1.0)
        ]
        if atom.kind in ("norm", "norm_inf"):
            return rows + [(row - t, -c) for row, c in both]
        root = math.sqrt(self._limit)
        for q in (*_TANGENTS, *(root * each for each in _TANGENTS)):
            if atom.kind == "squares":
                rows += [(2.0 * q * row - t, q * q - 2.0 * q * c) for row, c in both]
            else:
                # Of |w|^2 / s, with s as first entry.
                rows.append((-M[0], float(m[0])))
                rows += [
                    (2.0 * q * row - q * q * M[0] - t, float(q * q * m[0]) - 2.0 * q * c)
                    for row, c in both[2:]
                ]
        return rows

    def _polyhedron(self, rows: Rows, boxes: Mapping[int, tuple[np.ndarray, np.ndarray]]) -> Rows:
        found = list(rows)
        for number, first in self._firsts.items():
            for sides, sign in zip(boxes[number], (-1.0, 1.0), strict=True):
                units = sign * np.eye(self._size)[first : first + len(sides)]
                found += [
                    (unit, sign * side)
                    for unit, side in zip(units, sides.tolist(), strict=True)
                    if math.isfinite(side)
                ]
        return found

    def _most(self, rows: Rows, d: np.ndarray) -> float:
        """Return the support of rows along d; -infinite where they leave nothing."""
        if not rows:
            return math.inf if d.any() else 0.0
        kept = HPolyhedron(np.array([r for r, _ in rows]), np.array([b for _, b in rows]))
        if kept.is_empty():
            return -math.inf
        found = kept.support(d)
        return float(found.value + found.gap)

    def reach(
        self,
        boxes: Mapping[int, tuple[np.ndarray, np.ndarray]],
        direction: Mapping[tuple[int, int], float],
        cost: float = 0.0,
    ) -> float:
        """Return the most of a direction, and of ``cost`` times the cost, over the polyhedron.

        ``direction`` has factors of coordinates, of the tail's point (0, k) or the head's (1, k).
        -infinite where the edge can't be taken.
        """
        d, constant = cost * self._cost[0], cost * self._cost[1]
        firsts = list(self._firsts.values())
        for (end, k), factor in direction.items():
            d[firsts[end] + k] += factor
        return self._most(self._polyhedron(self._all, boxes), d) + constant

    def check_cost(self, boxes: Mapping[int, tuple[np.ndarray, np.ndarray]]) -> None:
        """Raise ConvexSetError where the linear part of the cost may be below 0."""
        row, constant = self._cost
        linear = row.copy()
        linear[self._first_atom :] = 0.0
        if not linear.any():
            return
        low = constant - self._most(self._polyhedron(self._of_sets, boxes), -linear)
        if low < -_NEGATIVE * max(1.0, abs(constant)):
            raise ConvexSetError(
                f"GraphOfConvexSets: edge {self.edge.name!r}: the linear part of the cost is"
                f" {low:.6g} at some points of the sets; costs must be at least 0 on all of both"
                " sets"
            )
