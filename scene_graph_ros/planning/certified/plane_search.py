"""The plane with most clearance between two geometries.

By a method for just this kind of program, which takes a fifth to a tenth of the time of a general
solver; where it does not get near enough to its bound, by the latter.
"""

from __future__ import annotations

from fractions import Fraction
import functools

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.convex.solve.cones.solver_choice import SolverChoice
from scene_graph_ros.convex.solve.sums_of_squares.weighted_squares import (
    Identities,
    minimize_over_squares,
    WeightedSquares,
)
from scene_graph_ros.planning.certified.monomials import triangle
from scene_graph_ros.planning.certified.pair_certificate import LEAST_CLEARANCE
from scene_graph_ros.planning.certified.pair_problem import PairProblem
from scene_graph_ros.planning.certified.pair_side import Side
from scene_graph_ros.planning.certified.separation_program import (
    NORMAL_ROOM,
    SeparationProgram,
    Solution,
)

__all__ = ["most_clearance", "normal_identities", "plane_for_growth"]

_GAP, _LEAST = 1e-4, 1e-8
"""What a better plane might have more: of the clearance, or metres."""

_ROUGH_GAP, _ROUGH_LEAST = 1e-2, 1e-7
"""The same where rounding ends the search before."""


_GROWTH_GAP = 1e-7
"""The same where what rows come times is to be 0 if it can be."""

_MULTIPLIER_COST = 0.3
"""Share of the clearance that is given for a trace of 1 of what the region's rows come times."""


def most_clearance(problem: PairProblem) -> Solution:
    """Return a plane with the most clearance. Raises SolverError."""
    solution, found = _search(problem, _GAP)
    return solution if _is_enough(found) else SeparationProgram(problem).maximize_clearance()


def plane_for_growth(problem: PairProblem, by: SolverChoice | None = None) -> Solution:
    """Return a plane with clearance that asks for little of where the region's rows are.

    A row's factor is the loss in the identities by moving it out. A solver that is chosen
    looks for the most clearance alone. Raises SolverError.
    """
    if by is not None:
        return SeparationProgram(problem).maximize_clearance(by)
    best = most_clearance(problem)
    if best.clearance <= float(LEAST_CLEARANCE):
        return best
    solution, found = _search(problem, _GROWTH_GAP, _MULTIPLIER_COST * best.clearance)
    is_one = found.residual <= _LEAST and solution.clearance > float(LEAST_CLEARANCE)
    return solution if is_one else best


def _search(
    problem: PairProblem, gap: float, multiplier_cost: float = 0.0
) -> tuple[Solution, WeightedSquares]:
    n = len(problem.variables)
    rows = np.array([[float(v), *map(float, slopes)] for v, slopes in problem.all_rows])
    constant, directions = _planes(problem)
    sides = [side for side in problem.sides if len(side.hull.points)]
    parts = [normal_identities(n), *(_points(side, n, len(rows)) for side in sides)]
    parts = [_substituted(part, constant, directions) for part in parts]
    cost = np.zeros(directions.shape[1])
    cost[-1] = -1.0
    weights = np.where(np.arange(len(rows)) > 2 * n, multiplier_cost, 0.0)
    found = minimize_over_squares(rows, parts, cost, gap=gap, least=_LEAST, weights=weights)
    numbers = constant + directions @ found.x
    grams = iter(found.grams[1:])
    empty = np.zeros((0, len(rows), 1, 1))
    solution = Solution(
        numbers[:-1].reshape(4, n + 1),
        float(numbers[-1]),
        found.grams[0][0],
        tuple(next(grams) if len(side.hull.points) else empty for side in problem.sides),
    )
    return solution, found


def _is_enough(found: WeightedSquares) -> bool:
    """Tell whether the clearance is near the best one, and whether it is one is decided."""
    clearance, most = float(found.x[-1]), -found.bound
    if found.residual > _LEAST:
        return False
    if not found.is_solved and most - clearance > max(_ROUGH_GAP * abs(clearance), _ROUGH_LEAST):
        return False
    return (clearance > LEAST_CLEARANCE) == (most > LEAST_CLEARANCE)


def _planes(problem: PairProblem) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return plane and clearance as a constant ``(4 n + 5,)`` and directions ``(4 n + 5, f)``."""
    n = len(problem.variables)
    count = 4 * (n + 1) + 1
    if problem.half_space is None:
        return np.zeros(count), np.eye(count)
    beside = np.array(problem.half_space.plane(Fraction(0), n), dtype=np.float64)
    directions = np.zeros((count, 1))
    directions[3 * (n + 1)] = -1.0  # the offset's constant has the clearance in it
    directions[-1] = 1.0
    return np.append(beside.reshape(-1), 0.0), directions


def _substituted(
    part: Identities, constant: NDArray[np.float64], directions: NDArray[np.float64]
) -> Identities:
    if directions.shape[0] == directions.shape[1]:
        return part
    constants, factors = part.constants + part.factors @ constant, part.factors @ directions
    return Identities(part.base, part.shift, part.num_rows, constants, factors)


@functools.cache
def normal_identities(n: int) -> Identities:
    """Return that ``[[1, a'], [a, 1]]`` is semidefinite, with some room.

    Its entries are the monomials, those beside the diagonal twice.
    """
    i, j = triangle(4)
    base = np.empty((4, 4), dtype=np.int64)
    base[i, j] = base[j, i] = np.arange(10)
    constants, factors = np.zeros((n + 1, 10)), np.zeros((n + 1, 10, 4 * (n + 1) + 1))
    constants[0, i == j] = 1.0 - NORMAL_ROOM
    for k in range(n + 1):
        for axis in range(3):
            factors[k, base[0, axis + 1], axis * (n + 1) + k] = 2.0
    shift = np.arange((n + 1) * 10).reshape(n + 1, 10)
    count = constants.size
    return Identities(
        base, shift, 2 * n + 1, constants.reshape(1, count), factors.reshape(1, count, -1)
    )


def _points(side: Side, n: int, num_rows: int) -> Identities:
    """Return that all points of a side are beside the plane by their radius and the clearance."""
    monomials, points = side.monomials, side.numerators
    constants = np.zeros((len(points), monomials.num_monomials))
    constants[:, monomials.shift[0]] = -side.radius * points[:, 3]
    factors = np.zeros((len(points), monomials.num_monomials, 4 * (n + 1) + 1))
    columns = np.arange(n + 1)[:, np.newaxis] + (n + 1) * np.arange(4)
    factors[:, monomials.shift[:, :, np.newaxis], columns[:, np.newaxis, :]] = (
        side.sign * points.transpose(0, 2, 1)[:, np.newaxis]
    )
    factors[:, :, -1] = -side.clearance(len(monomials.basis))
    return Identities(monomials.base, monomials.shift, num_rows, constants, factors)
