"""A plane that does not move, between two geometries that are far enough apart.

The plane with most clearance in the middle of the region is tried for all of it. Numerators are
then polynomials whose constants are no less than all other coefficients together: nothing has to
be shown by sums of squares, and no program in the region's variables is solved. In regions that
are small beside the clearances that is enough for nearly all pairs.
"""

from __future__ import annotations

from fractions import Fraction
import math

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.convex.solve.sums_of_squares.weighted_squares import (
    Identities,
    minimize_over_squares,
)
from scene_graph_ros.planning.certified.exact_matrices import exact_array, ExactStack
from scene_graph_ros.planning.certified.identities import least_values
from scene_graph_ros.planning.certified.pair_certificate import LEAST_CLEARANCE, PairCertificate
from scene_graph_ros.planning.certified.pair_problem import PairProblem
from scene_graph_ros.planning.certified.pair_side import Side
from scene_graph_ros.planning.certified.plane_search import normal_identities

__all__ = ["constant_plane", "plane_in_the_middle"]

_GRID = 2**44
"""The plane is a multiple of its inverse."""

_GAP, _LEAST = 1e-2, 1e-4
"""Of the clearance in the middle, and metres, that the plane there may have less than the best."""

_SHORTER = 1.0 - 2.0**-16
"""The length of its normal."""

_LEFT = 2.0**-40
"""What numerators keep, relative to their size: more than floats are off by."""

_MOST = 2.0**17
"""What a Gram matrix has at most; the rest of a numerator stays where it is."""

_ROUNDS = 3
"""How often plane and clearance are corrected."""

Floats = NDArray[np.float64]


def constant_plane(problem: PairProblem) -> PairCertificate | None:
    """Return a certificate whose plane does not move, or None where that is not enough."""
    n = len(problem.variables)
    sides = [side for side in problem.sides if len(side.hull.points)]
    if problem.half_space is None:
        plane = plane_in_the_middle(sides)
        if plane is None:
            return None
        for _ in range(_ROUNDS):
            above, below = (_clearance(side, plane) for side in sides)
            plane[3] += 0.5 * (below - above)
        claimed = _on_grid(min(_clearance(side, plane) for side in sides))
        exact = tuple((_on_grid(v), *[Fraction(0)] * n) for v in plane)
    else:
        parallel = problem.half_space.plane(Fraction(0), n)
        # The clearance is on both sides of the plane.
        beside = np.array([row[0] for row in parallel], dtype=np.float64)
        claimed = _on_grid(0.5 * _clearance(sides[0], beside))
        exact = problem.half_space.plane(claimed, n)
    if claimed < LEAST_CLEARANCE:
        return None
    plane, grams = np.array([row[0] for row in exact], dtype=np.float64), []
    for side in sides:
        spare = _least(side, _numerators(side, plane), float(claimed))
        whole = np.zeros((len(spare), 2 * n + 1 + len(problem.rows), 1, 1), dtype=np.int64)
        whole[:, 0, 0, 0] = np.clip(spare, 0.0, _MOST) * _GRID
        grams += [ExactStack(own, _GRID) for own in whole]
    certificate = PairCertificate(problem, exact, claimed, _normal_grams(exact), tuple(grams))
    return certificate if certificate.verify() else None


def plane_in_the_middle(sides: list[Side]) -> Floats | None:
    """Return the plane ``(4,)`` where all u are 0, None if they are not apart there."""
    parts = [normal_identities(0)]
    none = np.zeros((1, 1), dtype=np.int64)
    for side in sides:
        points = side.numerators[:, :, 0]
        factors = np.column_stack([side.sign * points, -points[:, 3]])[:, np.newaxis]
        parts.append(Identities(none, none, 1, -side.radius * points[:, 3:], factors))
    cost = np.array([0.0, 0.0, 0.0, 0.0, -1.0])
    found = minimize_over_squares(np.ones((1, 1)), parts, cost, gap=_GAP, least=_LEAST).x
    if not found[4] > 0.0:
        return None
    return np.asarray(found[:4] * (_SHORTER / np.linalg.norm(found[:3])))


def _numerators(side: Side, plane: Floats) -> Floats:
    """Return the numerators ``(p, q)`` of points beside a constant plane, without a clearance."""
    result = np.matmul(side.sign * plane, side.numerators)
    result -= side.radius * side.numerators[:, 3]
    return np.asarray(result)


def _least(side: Side, numerators: Floats, clearance: float) -> Floats:
    """Return a lower bound of each numerator's remainder in all the region, with a clearance."""
    is_square = side.monomials.is_square[side.monomials.shift[0]]
    found = least_values(numerators - clearance * side.frame.floats[12], is_square)
    return found - _LEFT * (1.0 + np.abs(numerators).sum(axis=1))


def _clearance(side: Side, plane: Floats) -> float:
    """Return a clearance that all points are shown to keep, negative where there is none."""
    numerators, clearance = _numerators(side, plane), 0.0
    most = np.abs(side.frame.floats[12]).sum()
    for _ in range(_ROUNDS):
        # A change of it takes no more than that from what is left.
        clearance += _least(side, numerators, clearance).min() / most
    return float(clearance)


def _normal_grams(plane: tuple[tuple[Fraction, ...], ...]) -> ExactStack:
    """Return ``[[1, a'], [a, 1]]`` for the constant row, and zeros for all bounds."""
    found = exact_array(plane)
    whole = np.zeros((2 * found.whole.shape[1] - 1, 4, 4), dtype=object)
    whole[0] = np.eye(4, dtype=np.int64).astype(object) * found.common
    whole[0, 0, 1:] = whole[0, 1:, 0] = found.whole[:3, 0]
    return ExactStack(whole, found.common)


def _on_grid(value: float) -> Fraction:
    return Fraction(math.floor(value * _GRID), _GRID)
