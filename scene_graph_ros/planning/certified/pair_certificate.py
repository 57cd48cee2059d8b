"""What shows that two geometries keep apart in a region, checked without a solver."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

from scene_graph_ros.planning.certified.identities import (
    gram_sum,
    is_positive_semidefinite,
    Matrix,
    normal_residuals,
)
from scene_graph_ros.planning.certified.pair_problem import PairProblem, plane_of

__all__ = ["LEAST_CLEARANCE", "PairCertificate"]

LEAST_CLEARANCE = Fraction(1, 10**8)
"""Metres: what rounding may move links by, with room for coordinates up to a kilometre."""


@dataclass(frozen=True)
class PairCertificate:
    """A plane, and Gram matrices that show what it keeps, all rational.

    ``plane`` has the three coordinates of the normal, then the offset, each the constant and the
    factors of u. ``clearance`` (m) is kept on both sides of it. ``normal_grams`` show that the
    normal is no longer than 1, ``grams`` that each point is beside the plane: a matrix for each
    row of the problem.
    """

    problem: PairProblem
    plane: tuple[tuple[Fraction, ...], ...]
    clearance: Fraction
    normal_grams: tuple[Matrix, ...]
    grams: tuple[tuple[Matrix, ...], ...]

    @property
    def distance(self) -> float:
        """Metres: a lower bound of the two geometries' distance, less their padding."""
        return 2.0 * float(self.clearance)

    def verify(self) -> bool:
        """Tell whether all identities hold, and all matrices are semidefinite, exactly."""
        return self.failure() is None

    def failure(self) -> str | None:
        """Return what does not hold, or None."""
        n = len(self.problem.variables)
        if self.clearance < LEAST_CLEARANCE:
            return f"the clearance is {float(self.clearance):.3g} m"
        if [len(row) for row in self.plane] != [n + 1] * 4:
            return "the plane is of other variables"
        half_space = self.problem.half_space
        if half_space is not None and self.plane != half_space.plane(self.clearance, n):
            return "the plane is not beside the half space"
        if len(self.normal_grams) != 2 * n + 1 or any(len(m) != 4 for m in self.normal_grams):
            return "the normal has other matrices"
        if not all(map(is_positive_semidefinite, self.normal_grams)):
            return "a matrix of the normal is not semidefinite"
        residuals = normal_residuals(self.normal_grams, self.plane)
        if any(v for matrix in residuals for line in matrix.whole for v in line):
            return "the normal is not bounded"
        polynomials = plane_of([list(row) for row in self.plane])
        points, rows = list(self.problem.points()), self.problem.row_polynomials
        if len(points) != len(self.grams):
            return "points are missing"
        for number, ((side, point), matrices) in enumerate(zip(points, self.grams, strict=True)):
            basis = side.basis(n)
            if len(matrices) != len(rows) or any(len(m) != len(basis) for m in matrices):
                return f"point {number} has other matrices"
            if not all(map(is_positive_semidefinite, matrices)):
                return f"a matrix of point {number} is not semidefinite"
            if side.numerator(point, polynomials, self.clearance) != gram_sum(
                matrices, rows, basis
            ):
                return f"the identity of point {number} does not hold"
        return None
