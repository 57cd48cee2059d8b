"""One of two geometries that a plane is between, and where its points are."""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
import math

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.planning.certified.exact_matrices import exact_array, ExactArray
from scene_graph_ros.planning.certified.monomials import Monomials, monomials_of
from scene_graph_ros.planning.certified.pair_shapes import RoundedHull
from scene_graph_ros.planning.certified.polynomials import weighted_sum
from scene_graph_ros.planning.certified.rational_kinematics import RationalPose

__all__ = ["SHARE_OF_SQUARES", "BodyPoints", "MovingFrame", "Side"]

SHARE_OF_SQUARES = 2**10
"""The inverse of what a clearance comes times more than the denominator."""


@dataclass(frozen=True, eq=False)
class MovingFrame:
    """A joint's frame J as it is seen from E.

    ``pose`` is X_EJ in u, scaled so that its denominator is at most 1 in the region, and the sum
    of the latter's coefficients as well. ``moving`` are the variables of u in it.
    """

    pose: RationalPose
    moving: tuple[int, ...]

    @property
    def monomials(self) -> Monomials:
        """The monomials of the identities of points fixed in J."""
        return monomials_of(len(next(iter(self.pose.denominator))), self.moving)

    @cached_property
    def coefficients(self) -> ExactArray:
        """Of the monomials' products, a column each: of the pose, line by line, ``(13, q)``.

        The last line is the denominator.
        """
        entries = [*(p for row in self.pose.matrix for p in row), self.pose.denominator]
        common = math.lcm(*(p.common for p in entries))
        place = {e: k for k, e in enumerate(self.monomials.products)}
        whole = np.zeros((13, len(place)), dtype=object)
        for line, entry in zip(whole, entries, strict=True):
            for e, value in entry.whole.items():
                line[place[e]] = value * (common // entry.common)
        return ExactArray(whole, common)

    @cached_property
    def floats(self) -> NDArray[np.float64]:
        """The same in floats."""
        return self.coefficients.floats()


@dataclass(frozen=True, eq=False)
class BodyPoints:
    """A geometry's hull, and where it is in the frame J of its joint: ``X_JG (3, 4)``."""

    hull: RoundedHull
    X_JG: NDArray[np.float64]

    @cached_property
    def points(self) -> ExactArray:
        """The hull's points in J ``(p, 4)``, with a 1 behind each."""
        count = len(self.hull.points)
        p_Gs = exact_array(np.column_stack([self.hull.points, np.ones(count)]))
        pose = exact_array(np.vstack([self.X_JG, [0.0, 0.0, 0.0, 1.0]]))
        whole = np.matmul(p_Gs.whole.reshape(count, 4), pose.whole.T)
        return ExactArray(whole, p_Gs.common * pose.common)

    @cached_property
    def floats(self) -> NDArray[np.float64]:
        """The same in floats."""
        return self.points.floats().reshape(-1, 4)


@dataclass(frozen=True, eq=False)
class Side:
    """One of the two geometries; ``radius`` has a padding in it."""

    sign: int
    frame: MovingFrame
    body: BodyPoints
    radius: float

    def only(self, points: NDArray[np.intp]) -> Side:
        """Return the same of some of the points."""
        hull = RoundedHull(self.hull.points[points], self.hull.radius)
        return replace(self, body=BodyPoints(hull, self.body.X_JG))

    @property
    def hull(self) -> RoundedHull:
        """The hull that the plane is beside."""
        return self.body.hull

    @property
    def moving(self) -> tuple[int, ...]:
        """The variables that move it."""
        return self.frame.moving

    @property
    def monomials(self) -> Monomials:
        """Those of its identities."""
        return self.frame.monomials

    @property
    def pose(self) -> RationalPose:
        """X_EG in u, with the denominator of the frame."""
        X_JG = [[Fraction(float(v)) for v in row] for row in self.body.X_JG]
        factors = [[row[k] for row in X_JG] + [Fraction(int(k == 3))] for k in range(4)]
        matrix = [
            [weighted_sum(zip(column, line, strict=True)) for column in factors]
            for line in self.frame.pose.matrix
        ]
        return RationalPose(matrix, self.frame.pose.denominator)

    @cached_property
    def numerators(self) -> NDArray[np.float64]:
        """Of each point the coordinates in E, and the denominator, ``(p, 4, q)``, in floats."""
        points, floats = self.body.floats, self.frame.floats
        result = np.empty((len(points), 4, floats.shape[1]))
        result[:, :3] = np.einsum("pj,ijq->piq", points, floats[:12].reshape(3, 4, -1))
        result[:, 3] = floats[12]
        return result

    def exact_clearance(self, order: int) -> ExactArray:
        """Return the factor of a clearance in a numerator: a polynomial ``(k,)``.

        It is at least the denominator. With Gram matrices of order 1 it is that; with larger ones
        there is a little more, which is in their inside: some of all products of ``1 + u^2``.
        """
        monomials, pose = self.monomials, self.frame.coefficients
        result = np.zeros(monomials.num_monomials, dtype=object)
        if order == 1:
            result[monomials.shift[0]] = pose.whole[12]
            return ExactArray(result, pose.common)
        result[monomials.shift[0]] = pose.whole[12] * SHARE_OF_SQUARES
        result[monomials.squares] += pose.common
        return ExactArray(result, pose.common * SHARE_OF_SQUARES)

    def clearance(self, order: int) -> NDArray[np.float64]:
        """Return the same in floats."""
        monomials = self.monomials
        result = np.zeros(monomials.num_monomials)
        result[monomials.shift[0]] = self.frame.floats[12]
        if order > 1:
            result[monomials.squares] += 1.0 / SHARE_OF_SQUARES
        return result

    @property
    def denominator_gram(self) -> NDArray[np.float64]:
        """The denominator as a semidefinite Gram matrix: a product of one for each variable."""
        base = self.monomials.base
        return np.asarray((self.frame.floats[12] / np.bincount(base.reshape(-1)))[base])
