"""From a solver's floats to rational numbers that prove their answer.

Plane and Gram matrices are rounded to a grid. The difference of a numerator and its Gram
matrices need not be zero, only surely not negative where no variable is larger than 1, and
giving up some clearance makes it so (compare Peyrl and Parrilo, "Computing sum of squares
decompositions with rational coefficients", 2008, who project it away). The remainder of that is
put into the Gram matrix of the constant row, so that a certificate claims nothing more than it
shows. The bound of the normal holds to the last digit.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.planning.certified.exact_matrices import exact_array, ExactArray, ExactStack
from scene_graph_ros.planning.certified.identities import (
    float_residuals,
    least_values,
    normal_residuals,
)
from scene_graph_ros.planning.certified.pair_certificate import PairCertificate
from scene_graph_ros.planning.certified.pair_problem import PairProblem
from scene_graph_ros.planning.certified.pair_side import SHARE_OF_SQUARES, Side
from scene_graph_ros.planning.certified.separation_program import NORMAL_ROOM, Solution

__all__ = ["KEPT_CLEARANCES", "rounded"]

KEPT_CLEARANCES = (0.999, 0.9, 0.5)
"""Shares of the clearance that the solver found, of which the first that is proven is kept."""

_GRID = 2**44
"""Plane and matrices are multiples of its inverse."""

_ROOM = 2.0**-40
"""What Gram matrices get on their diagonals at least, of which rounding takes a part."""

_LEFT = 2.0**-40
"""What numerators keep beyond what matrices show, relative to the size of the latter: more than
floats are off by."""


def rounded(problem: PairProblem, solution: Solution, share: float) -> PairCertificate:
    """Return a certificate that claims a share of the clearance; it may not hold."""
    n = len(problem.variables)
    plane = tuple(tuple(_on_grid(v) for v in row) for row in solution.plane.tolist())
    clearance = _on_grid(share * solution.clearance)
    if problem.half_space is not None:
        plane = problem.half_space.plane(clearance, n)
    extras = _extras(problem, solution, share)
    stacks: list[ExactStack] = []
    for number, (side, grams) in enumerate(zip(problem.sides, solution.grams, strict=True)):
        if not len(grams):
            continue
        more = extras[:, np.newaxis, np.newaxis] * np.eye(grams.shape[-1])
        if grams.shape[-1] > 1:
            more[0] += (1.0 - share) * solution.clearance * side.denominator_gram
        if solution.chosen is None:
            stacks += _stacks(problem, side, plane, clearance, grams + more)
            continue
        chosen, every = solution.chosen[number], np.arange(len(side.hull.points))
        others = np.setdiff1d(every, chosen)
        zeros = np.zeros((len(others), len(extras), 1, 1))
        own: dict[int, ExactStack] = {}
        for points, floats in ((chosen, grams + more), (others, zeros)):
            if len(points):
                part = _stacks(problem, side.only(points), plane, clearance, floats)
                own.update(zip(points.tolist(), part, strict=True))
        stacks += [own[k] for k in every.tolist()]
    spread = NORMAL_ROOM / (4.0 * (n + 1))
    normal = solution.normal_grams.copy()
    normal[1:] += spread * np.eye(4)
    return PairCertificate(
        problem,
        plane,
        clearance,
        _corrected_normal(ExactArray(_grid_matrices(normal), _GRID), exact_array(plane)),
        tuple(stacks),
    )


def _stacks(
    problem: PairProblem,
    side: Side,
    plane: tuple[tuple[Fraction, ...], ...],
    clearance: Fraction,
    grams: NDArray[np.float64],
) -> list[ExactStack]:
    """Return each point's Gram matrices; that of 1 gets the remainder of its numerator."""
    whole = _grid_matrices(grams)
    shown = np.asarray(whole / _GRID, dtype=np.float64)
    floats = np.array(plane, dtype=np.float64)
    residuals = float_residuals(side, floats, float(clearance), shown, problem.float_rows)
    left = _LEFT * (1.0 + np.abs(shown).max(axis=(1, 2, 3)))
    spare = least_values(residuals, side.monomials.is_square) - left
    whole[:, 0, 0, 0] += np.floor(np.maximum(spare, 0.0) * _GRID).astype(whole.dtype)
    return [ExactStack(own, _GRID) for own in whole]


def _extras(problem: PairProblem, solution: Solution, share: float) -> NDArray[np.float64]:
    """Return the addition to the diagonals of each row's Gram matrices, ``(r,)``.

    All of it together is less than the squares that are given up with the clearance; all else that
    is given up has a matrix of its own. A solver's matrices may be a little indefinite,
    and rounding moves them.
    """
    n, own = len(problem.variables), len(problem.rows)
    room = (1.0 - share) * solution.clearance / SHARE_OF_SQUARES
    bounds = room / (8.0 * (n + 1))
    parts = [0.25 * room], [bounds] * (2 * n), [bounds / (4.0 * (own + 1))] * own
    return _ROOM + np.concatenate(parts)


def _corrected_normal(grams: ExactArray, plane: ExactArray) -> ExactStack:
    """Add to Gram matrices the excess of the bound of the normal over them.

    A factor of u is ``1 + u`` by a half, less ``1 - u`` by a half.
    """
    residuals = normal_residuals(grams, plane)
    common = 2 * residuals.common
    whole = grams.whole.astype(object) * (common // grams.common)
    whole[0] += 2 * residuals.whole[0]
    whole[1::2] += residuals.whole[1:]
    whole[2::2] -= residuals.whole[1:]
    return ExactStack(whole, common)


def _on_grid(value: float) -> Fraction:
    return Fraction(round(value * _GRID), _GRID)


def _grid_matrices(values: NDArray[np.float64]) -> NDArray[Any]:
    """Return the nearest whole numbers of symmetric matrices times the grid's."""
    scaled = np.rint(0.5 * (values + np.swapaxes(values, -1, -2)) * _GRID)
    if np.abs(scaled).max() < 2.0**62:
        return scaled.astype(np.int64)
    return np.array([int(v) for v in scaled.reshape(-1)], dtype=object).reshape(values.shape)
