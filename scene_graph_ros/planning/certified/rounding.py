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
import math

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.planning.certified.identities import (
    ExactMatrix,
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

_GRID = 2**44
"""Plane and matrices are multiples of its inverse."""


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
    rows, grams = problem.row_polynomials, []
    for (side, point), floats in zip(problem.points(), solution.grams, strict=True):
        matrices = [
            _grid_matrix(gram + added * np.eye(len(gram)))
            for gram, added in zip(floats, extras, strict=True)
        ]
        wanted = side.numerator(point, polynomials, clearance)
        basis = side.basis(n)
        residual = total([wanted, scaled(gram_sum(matrices, rows, basis), Fraction(-1))])
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
    matrices: list[ExactMatrix], residual: Polynomial, basis: list[Exponents]
) -> tuple[Matrix, ...]:
    """Add a residual to the Gram matrices of the constant and of the bounds."""
    index = {e: i for i, e in enumerate(basis)}
    n = len(basis[0])
    moving = [k for k in range(n) if any(e[k] for e in basis)]
    # A monomial stands in up to 2^n places, and those of a bound take half.
    common = math.lcm(_GRID, residual.common << (n + 1))
    finer, factor = common // _GRID, common // residual.common
    bounds = 1 + 2 * n
    result = [[[v * finer for v in line] for line in m.whole] for m in matrices[:bounds]]
    for e, value in residual.whole.items():
        k = _spare_variable(e, moving)
        if k is None:
            _add_monomial(result[0], e, value * factor, index)
            continue
        rest, half = (*e[:k], e[k] - 1, *e[k + 1 :]), value * factor // 2
        _add_monomial(result[1 + 2 * k], rest, half, index)
        _add_monomial(result[2 + 2 * k], rest, -half, index)
    return (*(ExactMatrix(whole, common) for whole in result), *matrices[bounds:])


def _spare_variable(e: Exponents, moving: list[int]) -> int | None:
    """Return the variable whose power a product of two monomials of the basis has not, if any."""
    over = [k for k, power in enumerate(e) if power > (2 if k in moving else 0)]
    return over[0] if over else None


def _add_monomial(
    matrix: list[list[int]], e: Exponents, value: int, index: dict[Exponents, int]
) -> None:
    """Add a monomial to a Gram matrix, in equal parts wherever it stands."""
    choices = [((0, 1), (1, 0)) if v == 1 else ((v // 2, v // 2),) for v in e]
    places = list(itertools.product(*choices))
    part = value // len(places)
    for place in places:
        first, second = zip(*place, strict=True)
        matrix[index[first]][index[second]] += part


def _corrected_normal(
    matrices: list[ExactMatrix], plane: tuple[tuple[Fraction, ...], ...]
) -> tuple[Matrix, ...]:
    residuals = normal_residuals(matrices, plane)
    common = 2 * residuals[0].common

    def moved(matrix: ExactMatrix, residual: ExactMatrix, halves: int) -> ExactMatrix:
        finer = common // matrix.common
        return ExactMatrix(
            [
                [finer * v + halves * w for v, w in zip(line, own, strict=True)]
                for line, own in zip(matrix.whole, residual.whole, strict=True)
            ],
            common,
        )

    result = [moved(matrices[0], residuals[0], 2)]
    for k, residual in enumerate(residuals[1:], 1):
        result.append(moved(matrices[2 * k - 1], residual, 1))
        result.append(moved(matrices[2 * k], residual, -1))
    return tuple(result)


def _on_grid(value: float) -> Fraction:
    return Fraction(round(value * _GRID), _GRID)


def _grid_matrix(values: NDArray[np.float64]) -> ExactMatrix:
    rows = (0.5 * (values + values.T) * float(_GRID)).tolist()
    return ExactMatrix([[round(v) for v in row] for row in rows], _GRID)
