"""From a solver's floats to identities that hold exactly.

Plane and Gram matrices are rounded to a grid; what the identity is then off by goes into the Gram
matrices of the bounds and of the constant row, which can take every monomial: ``s u m`` is
``(1 + u) s/2 m - (1 - u) s/2 m``. That needs room, which giving up some clearance makes: it adds
to the constant row's Gram matrix a multiple of the unit matrix (compare Peyrl and Parrilo,
"Computing sum of squares decompositions with rational coefficients", 2008).
"""

from __future__ import annotations

from fractions import Fraction
import itertools

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.planning.certified.identities import (
    gram_sum,
    Matrix,
    normal_residuals,
)
from scene_graph_ros.planning.certified.pair_certificate import PairCertificate
from scene_graph_ros.planning.certified.pair_problem import PairProblem, plane_of
from scene_graph_ros.planning.certified.polynomials import Exponents, Polynomial, scaled, total
from scene_graph_ros.planning.certified.separation_program import NORMAL_ROOM, Solution

__all__ = ["KEPT_CLEARANCES", "rounded"]

KEPT_CLEARANCES = (0.99, 0.9, 0.5)
"""Shares of the clearance that the solver found, of which the first that is proven is kept."""

_BITS = 44
"""The grid: multiples of 2^-44."""


def rounded(problem: PairProblem, solution: Solution, share: float) -> PairCertificate:
    """Return a certificate that claims a share of the clearance; it may not hold."""
    n = len(problem.variables)
    plane = tuple(tuple(_on_grid(v) for v in row) for row in solution.plane.tolist())
    clearance = _on_grid(share * solution.clearance)
    if problem.half_space is not None:
        plane = problem.half_space.plane(clearance, n)
    room = (1.0 - share) * solution.clearance
    own = len(problem.rows)
    # What is added to the bounds' Gram matrices, and to those of other rows, on their diagonals.
    extra = room / (8.0 * (n + 1))
    extras = [0.0, *[extra] * (2 * n), *[extra / (4.0 * (own + 1))] * own]
    polynomials = plane_of([list(row) for row in plane])
    grams = []
    for (side, point), floats in zip(problem.points(), solution.grams, strict=True):
        matrices = [
            _grid_matrix(gram + added * np.eye(len(gram)))
            for gram, added in zip(floats, extras, strict=True)
        ]
        wanted = side.numerator(point, polynomials, clearance)
        basis = side.basis(n)
        residual = total(
            [wanted, scaled(gram_sum(matrices, problem.all_rows, basis), Fraction(-1))]
        )
        grams.append(_corrected(matrices, residual, basis))
    spread = NORMAL_ROOM / (4.0 * (n + 1))
    normal = [
        _grid_matrix(gram + (spread if number else 0.0) * np.eye(4))
        for number, gram in enumerate(solution.normal_grams)
    ]
    return PairCertificate(
        problem, plane, clearance, _corrected_normal(normal, plane), tuple(grams)
    )


def _corrected(
    matrices: list[Matrix], residual: Polynomial, basis: list[Exponents]
) -> tuple[Matrix, ...]:
    """Add a residual to the Gram matrices of the constant and of the bounds."""
    index = {e: i for i, e in enumerate(basis)}
    moving = [k for k in range(len(basis[0])) if any(e[k] for e in basis)]
    for e, value in residual.items():
        k = _spare_variable(e, moving)
        if k is None:
            _add_monomial(matrices[0], e, value, index)
            continue
        rest = (*e[:k], e[k] - 1, *e[k + 1 :])
        _add_monomial(matrices[1 + 2 * k], rest, value / 2, index)
        _add_monomial(matrices[2 + 2 * k], rest, -value / 2, index)
    return tuple(matrices)


def _spare_variable(e: Exponents, moving: list[int]) -> int | None:
    """Return the variable whose power a product of two monomials of the basis has not, if any."""
    over = [k for k, power in enumerate(e) if power > (2 if k in moving else 0)]
    return over[0] if over else None


def _add_monomial(
    matrix: Matrix, e: Exponents, value: Fraction, index: dict[Exponents, int]
) -> None:
    """Add a monomial to a Gram matrix, in equal parts wherever it stands."""
    choices = [((0, 1), (1, 0)) if v == 1 else ((v // 2, v // 2),) for v in e]
    places = list(itertools.product(*choices))
    for place in places:
        i, j = (index[tuple(pair[side] for pair in place)] for side in (0, 1))
        matrix[i][j] += value / len(places)


def _corrected_normal(
    matrices: list[Matrix], plane: tuple[tuple[Fraction, ...], ...]
) -> tuple[Matrix, ...]:
    for k, residual in enumerate(normal_residuals(matrices, plane)):
        for i, j in itertools.product(range(4), repeat=2):
            if k == 0:
                matrices[0][i][j] += residual[i][j]
            else:
                matrices[2 * k - 1][i][j] += residual[i][j] / 2
                matrices[2 * k][i][j] -= residual[i][j] / 2
    return tuple(matrices)


def _on_grid(value: float) -> Fraction:
    return Fraction(round(value * 2.0**_BITS), 2**_BITS)


def _grid_matrix(values: NDArray[np.float64]) -> Matrix:
    return [[_on_grid(v) for v in row] for row in (0.5 * (values + values.T)).tolist()]
