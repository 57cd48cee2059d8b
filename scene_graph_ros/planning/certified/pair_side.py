"""One of two geometries that a plane is between, and where its points are."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
import math

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.planning.certified.exact_matrices import exact_array, ExactArray
from scene_graph_ros.planning.certified.monomials import Monomials, monomials_of
from scene_graph_ros.planning.certified.pair_shapes import RoundedHull
from scene_graph_ros.planning.certified.rational_kinematics import RationalPose

__all__ = ["Side"]


@dataclass(frozen=True)
class Side:
    """One of the two geometries.

    ``pose`` is X_EG in u, scaled so that its denominator is at most 1 in the region. ``moving``
    are the variables of u in it; ``radius`` has a padding in it.
    """

    sign: int
    pose: RationalPose
    moving: tuple[int, ...]
    hull: RoundedHull
    radius: float

    @property
    def monomials(self) -> Monomials:
        """Those of its identities."""
        return monomials_of(len(next(iter(self.pose.denominator))), self.moving)

    @cached_property
    def numerators(self) -> ExactArray:
        """Of each point of the hull the coordinates in E, and the denominator: ``(p, 4, q)``.

        A column for each of the monomials' products.
        """
        entries = [*(p for row in self.pose.matrix for p in row), self.pose.denominator]
        common = math.lcm(*(p.common for p in entries))
        place = {e: k for k, e in enumerate(self.monomials.products)}
        whole = np.zeros((13, len(place)), dtype=object)
        for line, entry in zip(whole, entries, strict=True):
            for e, value in entry.whole.items():
                line[place[e]] = value * (common // entry.common)
        count = len(self.hull.points)
        points = exact_array(np.column_stack([self.hull.points, np.ones(count)]))
        result = np.empty((count, 4, len(place)), dtype=object)
        result[:, :3] = np.matmul(points.whole, whole[:12].reshape(3, 4, -1)).transpose(1, 0, 2)
        result[:, 3] = whole[12] * points.common
        return ExactArray(result, common * points.common)

    @cached_property
    def float_numerators(self) -> NDArray[np.float64]:
        """The same in floats."""
        return self.numerators.floats()
