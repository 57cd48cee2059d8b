"""The plane with most clearance between two geometries of many points.

It rests on few of them. The program is solved for some points, first those that are nearest in the
middle of the region; where the plane is not surely beside the others by the same clearance, the
worst of these are added. A point is surely beside it where the constant of its numerator is no
less than all other coefficients together: then it needs no matrices.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.planning.certified.constant_plane import plane_in_the_middle
from scene_graph_ros.planning.certified.identities import float_residuals, least_values
from scene_graph_ros.planning.certified.pair_certificate import LEAST_CLEARANCE
from scene_graph_ros.planning.certified.pair_problem import PairProblem
from scene_graph_ros.planning.certified.pair_side import Side
from scene_graph_ros.planning.certified.plane_search import most_clearance
from scene_graph_ros.planning.certified.separation_program import Solution

__all__ = ["best_plane"]

_MANY = 4000
"""Monomials of all points' identities, from which on points are chosen."""

_FIRST = 4
"""Points of each side that are chosen first, and are added at least."""

_KEPT = 0.9995
"""Share of the clearance that the others are to keep."""


def best_plane(problem: PairProblem) -> Solution:
    """Return a plane with the most clearance. Raises SolverError."""
    chosen = _first_points(problem)
    while chosen is not None:
        above, below = problem.sides
        sides = above.only(chosen[0]), below.only(chosen[1])
        found = most_clearance(replace(problem, sides=sides))
        if found.clearance <= float(LEAST_CLEARANCE):
            return found
        more = [
            _open_points(problem, side, own, found)
            for side, own in zip(problem.sides, chosen, strict=True)
        ]
        if not any(len(each) for each in more):
            return found._replace(chosen=chosen)
        both = [np.union1d(own, each) for own, each in zip(chosen, more, strict=True)]
        chosen = (both[0], both[1])
    return most_clearance(problem)


def _first_points(
    problem: PairProblem,
) -> tuple[NDArray[np.intp], NDArray[np.intp]] | None:
    """Return the points of both sides that are nearest in the middle; None for all of them."""
    count = sum(len(side.hull.points) * side.monomials.num_monomials for side in problem.sides)
    if count <= _MANY or problem.half_space is not None:
        return None
    plane = plane_in_the_middle(list(problem.sides))
    if plane is None:
        return None
    result = []
    for side in problem.sides:
        heights = side.sign * (side.numerators[:, :, 0] @ plane)
        result.append(np.sort(np.argsort(heights, kind="stable")[:_FIRST]))
    return result[0], result[1]


def _open_points(
    problem: PairProblem, side: Side, chosen: NDArray[np.intp], found: Solution
) -> NDArray[np.intp]:
    """Return points that are not surely beside the plane, the worst first; not all of them."""
    rows = np.zeros((0, len(problem.variables) + 1))
    none = np.zeros((len(side.hull.points), 2 * len(rows.T) - 1, 1, 1))
    residuals = float_residuals(side, found.plane, _KEPT * found.clearance, none, rows)
    least = least_values(residuals, side.monomials.is_square)
    least[chosen] = np.inf
    count = min(np.count_nonzero(least < 0.0), max(_FIRST, len(chosen)))
    return np.argsort(least, kind="stable")[:count]
