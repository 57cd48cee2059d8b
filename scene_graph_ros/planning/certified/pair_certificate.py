"""Proofs that two geometries keep apart in a region, checked without a solver."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.planning.certified.exact_matrices import (
    are_positive_semidefinite,
    exact_array,
    ExactArray,
    Matrix,
    stacked,
)
from scene_graph_ros.planning.certified.identities import (
    exact_residuals,
    least_values,
    normal_residuals,
)
from scene_graph_ros.planning.certified.lagrangians import (
    AffineFunction,
    SeparatingPlaneLagrangians,
)
from scene_graph_ros.planning.certified.pair_problem import PairProblem

__all__ = ["LEAST_CLEARANCE", "PairCertificate"]

LEAST_CLEARANCE = Fraction(1, 10**8)
"""Metres: what rounding may move links by, with room for coordinates up to a kilometre."""


@one_line()
@dataclass(frozen=True)
class PairCertificate:
    """A plane, and Gram matrices that prove its clearance, all rational.

    ``plane`` has the three coordinates of the normal, then the offset, each the constant and the
    factors of u. ``clearance`` (m) is kept on both sides of it. ``normal_grams`` show that the
    normal is no longer than 1, ``grams`` that each point is beside the plane: a matrix for each
    row of the problem, in its side's basis or in the constant alone. The part of a point's
    numerator beyond its matrices must not be negative, either: its constant is no less than all
    its other coefficients together.
    """

    problem: PairProblem
    plane: tuple[tuple[Fraction, ...], ...]
    clearance: Fraction
    normal_grams: Sequence[Matrix]
    grams: tuple[Sequence[Matrix], ...]

    @property
    def distance(self) -> float:
        """Metres: a lower bound of the two geometries' distance, less their padding."""
        return 2.0 * float(self.clearance)

    @property
    def plane_index(self) -> int:
        """Which of `CspaceFreePolytope.separating_planes` it is."""
        return self.problem.plane_index

    @property
    def a(self) -> AffineFunction:
        """The plane's normal ``(3,)`` as a function of s, in the frame of its ``expressed_body``.

        Of the two geometries the first is where ``a(s) . x + b(s)`` is at least the clearance, the
        second where it is at most minus that.
        """
        return AffineFunction.of_plane(self.problem, self.plane[:3])

    @property
    def b(self) -> AffineFunction:
        """The plane's offset ``(1,)`` as a function of s."""
        return AffineFunction.of_plane(self.problem, self.plane[3:])

    @property
    def plane_decision_var_vals(self) -> NDArray[np.float64]:
        """The coefficients of normal and offset in s ``(4 (nq + 1),)``, each constant first."""
        parts = [(self.a, k) for k in range(3)] + [(self.b, 0)]
        rows = [(f.constant[k], *f.factors[k]) for f, k in parts]
        return np.array(rows, dtype=np.float64).reshape(-1)

    @property
    def positive_side_rational_lagrangians(self) -> tuple[SeparatingPlaneLagrangians, ...]:
        """The multipliers of each point of the first geometry, the second is on the other side."""
        return self._lagrangians(0)

    @property
    def negative_side_rational_lagrangians(self) -> tuple[SeparatingPlaneLagrangians, ...]:
        """The multipliers of each point of the second geometry."""
        return self._lagrangians(1)

    def _lagrangians(self, number: int) -> tuple[SeparatingPlaneLagrangians, ...]:
        sides = self.problem.sides
        side = sides[number]
        first = number * len(sides[0].hull.points)
        own = self.grams[first : first + len(side.hull.points)]
        return tuple(
            SeparatingPlaneLagrangians.of_point(self.problem, side, grams) for grams in own
        )

    def verify(self) -> bool:
        """Tell whether all that is claimed is shown, in rational arithmetic."""
        return self.failure() is None

    def failure(self) -> str | None:
        """Return the condition that does not hold, or None."""
        n = len(self.problem.variables)
        if self.clearance < LEAST_CLEARANCE:
            return f"the clearance is {float(self.clearance):.3g} m"
        if [len(row) for row in self.plane] != [n + 1] * 4:
            return "the plane is of other variables"
        half_space = self.problem.half_space
        if half_space is not None and self.plane != half_space.plane(self.clearance, n):
            return "the plane is not beside the half space"
        plane = exact_array(self.plane)
        return self._failure_of_normal(plane) or self._failure_of_points(plane)

    def _failure_of_normal(self, plane: ExactArray) -> str | None:
        found = stacked([self.normal_grams], 2 * len(self.problem.variables) + 1, 4)
        if found is None:
            return "the normal has other matrices"
        grams = ExactArray(found.whole[0], found.common)
        if not are_positive_semidefinite(grams.whole):
            return "a matrix of the normal is not semidefinite"
        if (normal_residuals(grams, plane).whole != 0).any():
            return "the normal is not bounded"
        return None

    def _failure_of_points(self, plane: ExactArray) -> str | None:
        rows, first = self.problem.exact_rows, 0
        count = 2 * len(self.problem.variables) + 1 + len(rows.whole)
        if len(self.grams) != sum(len(side.hull.points) for side in self.problem.sides):
            return "points are missing"
        for side in self.problem.sides:
            own = self.grams[first : first + len(side.hull.points)]
            orders = [len(each[0]) if len(each) else 0 for each in own]
            for order in sorted(set(orders)):
                points = np.array([k for k, other in enumerate(orders) if other == order])
                grams = stacked([own[k] for k in points], count, order)
                if grams is None or order not in (1, len(side.monomials.basis)):
                    return f"point {first + points[0]} has other matrices"
                if not are_positive_semidefinite(grams.whole.reshape(-1, order, order)):
                    return f"a matrix of point {first + points[0]} or after is not semidefinite"
                part = side if len(points) == len(own) else side.only(points)
                residuals = exact_residuals(part, plane, self.clearance, grams, rows)
                least = least_values(residuals, side.monomials.is_square)
                if (least < 0).any():
                    point = first + points[int(np.argmax(least < 0))]
                    return f"the matrices of point {point} do not show its clearance"
            first += len(own)
        return None
