"""Both sides of a certificate's identities, in floats or exactly.

Polynomials are their coefficients, a column for each of a side's monomials. Arrays are of floats,
of int64 where that is exact, or of whole numbers as objects.
"""

from __future__ import annotations

from fractions import Fraction
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.planning.certified.exact_matrices import ExactArray, summable
from scene_graph_ros.planning.certified.monomials import Monomials
from scene_graph_ros.planning.certified.pair_side import Side

__all__ = [
    "exact_residuals",
    "float_residuals",
    "gram_sums",
    "least_values",
    "normal_residuals",
]


def gram_sums(grams: NDArray[Any], monomials: Monomials) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return the polynomials ``(p, k)`` of Gram matrices ``(p, r, m, m)`` of a region's bounds.

    Rows are 1, then ``1 + u`` and ``1 - u`` of each variable. Of all others there is
    ``m(u)' G m(u)`` alone, ``(p, rest, q)``. The basis m may be the constant alone.
    """
    count, m = monomials.shift.shape[1], grams.shape[-1]
    place = np.zeros((m * m, count), dtype=np.int64)
    place[np.arange(m * m), monomials.base[:m, :m].reshape(-1)] = 1
    products = grams.reshape(*grams.shape[:2], m * m) @ place
    bounds = 2 * len(monomials.shift) - 1
    result = np.zeros((len(grams), monomials.num_monomials), dtype=products.dtype)
    result[:, monomials.shift[0]] = products[:, :bounds].sum(axis=1)
    for k, places in enumerate(monomials.shift[1:]):
        result[:, places] += products[:, 2 * k + 1] - products[:, 2 * k + 2]
    return result, products[:, bounds:]


def exact_residuals(
    side: Side, plane: ExactArray, clearance: Fraction, grams: ExactArray, rows: ExactArray
) -> NDArray[Any]:
    """Return numerators less the polynomials of Gram matrices ``(p, r, m, m)``, times a number.

    A numerator is a polynomial that is not negative where a point keeps its radius and the
    clearance, times the denominator: for the clearance times at least that, see
    `Side.exact_clearance`. ``rows (own, n + 1)`` are the region's own. Where a plane does not
    move, and bounds show nothing, there are no more monomials than the products.
    """
    monomials, radius = side.monomials, Fraction(side.radius)
    pose, points = side.frame.coefficients, side.body.points
    kept = side.exact_clearance(grams.whole.shape[-1])
    sums, rest = gram_sums(summable(grams.whole, grams.whole[0].size), monomials)
    beside, own = pose.common * plane.common * points.common, grams.common * rows.common
    common = math.lcm(
        beside,
        pose.common * radius.denominator,
        kept.common * clearance.denominator,
        own,
    )
    # The plane's coordinates in J, of which there are fewer than points.
    seen = np.matmul(plane.whole[:3].T, pose.whole[:12].reshape(3, -1))
    seen = seen.reshape(-1, 4, len(monomials.products))
    seen[:, 3] += np.multiply.outer(plane.whole[3], pose.whole[12])
    seen *= side.sign * (common // beside)
    is_short = not (plane.whole[:, 1:] != 0).any() and not (grams.whole[:, 1:] != 0).any()
    width = len(monomials.products) if is_short else monomials.num_monomials
    result = np.zeros((len(points.whole), width), dtype=object)
    for coordinates, places in zip(seen, monomials.shift, strict=True):
        if (coordinates != 0).any():
            result[:, places] += np.matmul(points.whole, coordinates)
    weight = radius.numerator * (common // (pose.common * radius.denominator))
    result[:, monomials.shift[0]] -= pose.whole[12] * weight
    result -= kept.whole[:width] * (
        clearance.numerator * (common // (kept.common * clearance.denominator))
    )
    result -= sums[:, :width].astype(object) * (common // grams.common)
    for k, places in enumerate(monomials.shift if rest.any() else ()):
        factors = rows.whole[:, k] * (common // own)
        result[:, places] -= np.matmul(factors, rest.astype(object))
    return result


def float_residuals(
    side: Side,
    plane: NDArray[np.float64],
    clearance: float,
    grams: NDArray[np.float64],
    rows: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return the same in floats."""
    monomials, points = side.monomials, side.numerators
    sums, rest = gram_sums(grams, monomials)
    result = -sums - clearance * side.clearance(grams.shape[-1])
    terms = np.matmul(side.sign * plane.T, points)
    for k, places in enumerate(monomials.shift):
        result[:, places] += terms[:, k] - np.matmul(rows[:, k], rest)
    result[:, monomials.shift[0]] -= side.radius * points[:, 3]
    return np.asarray(result)


def least_values(residuals: NDArray[Any], is_square: NDArray[np.bool_]) -> NDArray[Any]:
    """Return lower bounds ``(p,)`` of polynomials ``(p, k)`` where all variables are in [-1, 1].

    The first coefficient, which is the constant, less all others; of squares those that are
    negative.
    """
    rest = residuals[:, 1:]
    lost = np.where(is_square[1 : residuals.shape[1]], np.minimum(rest, 0), -np.abs(rest))
    return np.asarray(residuals[:, 0] + lost.sum(axis=1))


def normal_residuals(grams: ExactArray, plane: ExactArray) -> ExactArray:
    """Return ``[[1, a'], [a, 1]]`` less the sum of Gram matrices ``(r, 4, 4)``.

    ``(n + 1, 4, 4)``: the constant part first, then the factors of each variable.
    """
    common = math.lcm(grams.common, plane.common)
    own = summable(grams.whole, len(grams.whole)).astype(object) * (common // grams.common)
    result = np.zeros((plane.whole.shape[1], 4, 4), dtype=object)
    result[0] = np.eye(4, dtype=np.int64).astype(object) * common
    sides = plane.whole[:3].T * (common // plane.common)
    result[:, 0, 1:] += sides
    result[:, 1:, 0] += sides
    result[0] -= own.sum(axis=0)
    result[1:] -= own[1::2] - own[2::2]
    return ExactArray(result, common)
