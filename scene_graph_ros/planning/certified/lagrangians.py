"""The polynomials that a certificate is made of, as functions of s: planes and multipliers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.real_arrays import real_array
from scene_graph_ros.planning.certified.errors import CertificateError
from scene_graph_ros.planning.certified.exact_matrices import Matrix
from scene_graph_ros.planning.certified.pair_problem import PairProblem
from scene_graph_ros.planning.certified.pair_side import Side

__all__ = ["AffineFunction", "Lagrangian", "SeparatingPlaneLagrangians"]


@one_line()
@dataclass(frozen=True, eq=False)
class AffineFunction:
    """``constant (k,) + factors (k, nq) s``, of rational numbers; called, it returns floats."""

    constant: tuple[Fraction, ...]
    factors: tuple[tuple[Fraction, ...], ...]

    @classmethod
    def of_plane(cls, problem: PairProblem, rows: Sequence[Sequence[Fraction]]) -> AffineFunction:
        """Return rows that are affine in a problem's u, the constant first, as functions of s."""
        constants, factors = [], []
        for constant, *slopes in rows:
            own = [Fraction(0)] * problem.num_positions
            for k, slope, stretch in zip(
                problem.variables, slopes, problem.stretches, strict=True
            ):
                own[k] = slope / stretch.half
                constant = constant - own[k] * stretch.middle
            constants.append(constant)
            factors.append(tuple(own))
        return cls(tuple(constants), tuple(factors))

    def __call__(self, s: ArrayLike) -> NDArray[np.float64]:
        """Return the values ``(..., k)`` at s ``(..., nq)``. Raises CertificateError."""
        points = _points(s, len(self.factors[0]))
        factors = np.array(self.factors, dtype=np.float64)
        return points @ factors.T + np.array(self.constant, dtype=np.float64)


@one_line()
@dataclass(frozen=True, eq=False)
class Lagrangian:
    """A sum of squares of s: ``m(u)' gram m(u)``, with u in [-1, 1] where s is in the region.

    m are all products of different ones of the variables u that move the geometry, or the
    constant alone; ``variables`` are the positions of q whose s they are.
    """

    gram: tuple[tuple[Fraction, ...], ...]
    variables: tuple[int, ...]
    exponents: tuple[tuple[int, ...], ...]
    middles: tuple[Fraction, ...]
    halves: tuple[Fraction, ...]
    num_positions: int

    def __call__(self, s: ArrayLike) -> NDArray[np.float64]:
        """Return the values ``(...,)`` at s ``(..., nq)``. Raises CertificateError."""
        points = _points(s, self.num_positions)
        middles, halves = (np.array(v, dtype=np.float64) for v in (self.middles, self.halves))
        u = (points[..., list(self.variables)] - middles) / halves
        m = np.prod(u[..., np.newaxis, :] ** np.array(self.exponents, dtype=np.int64), axis=-1)
        gram = np.array(self.gram, dtype=np.float64)
        return np.asarray(np.einsum("...i,ij,...j->...", m, gram, m))


@one_line()
@dataclass(frozen=True, eq=False)
class SeparatingPlaneLagrangians:
    """The multipliers of one rational, a point's numerator, over the rows of a region.

    ``numerator - polytope . (d - C s) - s_lower . (s - s_lower) - s_upper . (s_upper - s)`` is not
    negative in the region: it is ``constant``, itself a sum of squares, and a part that has no
    squares but is no less than its other coefficients together. Only rows and bounds that are
    about the pair's positions have multipliers; ``rows`` and ``positions`` say which.
    """

    polytope: tuple[Lagrangian, ...]
    s_lower: tuple[Lagrangian, ...]
    s_upper: tuple[Lagrangian, ...]
    constant: Lagrangian
    rows: tuple[int, ...]
    positions: tuple[int, ...]

    @classmethod
    def of_point(
        cls, problem: PairProblem, side: Side, grams: Sequence[Matrix]
    ) -> SeparatingPlaneLagrangians:
        """Return those of one point of a side: a Gram matrix for each row of its problem."""
        n = len(problem.variables)
        halves = [each.half for each in problem.stretches]
        # A row in u is one in s over these.
        scales = [Fraction(1), *(h for h in halves for _ in range(2)), *problem.row_scales]
        exponents = side.monomials.basis

        def of_row(number: int) -> Lagrangian:
            rows = tuple(
                tuple(Fraction(v) / scales[number] for v in line) for line in grams[number]
            )
            return Lagrangian(
                rows,
                problem.variables,
                exponents if len(rows) > 1 else exponents[:1],
                tuple(each.middle for each in problem.stretches),
                tuple(halves),
                problem.num_positions,
            )

        return cls(
            tuple(of_row(k) for k in range(2 * n + 1, len(scales))),
            tuple(of_row(1 + 2 * k) for k in range(n)),
            tuple(of_row(2 + 2 * k) for k in range(n)),
            of_row(0),
            problem.row_numbers,
            problem.variables,
        )


def _points(s: ArrayLike, count: int) -> NDArray[np.float64]:
    points = real_array(s, "s must be numbers", CertificateError)
    if points.shape[-1:] != (count,):
        raise CertificateError(f"s must have shape (..., {count}), not {points.shape}")
    return points
