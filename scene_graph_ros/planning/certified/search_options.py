"""Options of searches for certified polytopes, under the names they have in the literature."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import enum
import math

import numpy as np

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.planning.certified.errors import CertificateError

__all__ = ["BilinearAlternationOptions", "BinarySearchOptions", "EllipsoidMarginCost"]


class EllipsoidMarginCost(enum.Enum):
    """What is the largest of the margins between a polytope's faces and the ellipsoid inside."""

    SUM = "sum"
    """One face may stay where it is for the others."""
    GEOMETRIC_MEAN = "geometric mean"
    """That of margins and an epsilon: faces move more alike."""


@one_line()
@dataclass(frozen=True)
class BinarySearchOptions:
    """How a polytope is scaled about a point: between which factors, how often, how exactly.

    The search ends where the largest factor that was proven, and the smallest that was not, differ
    by ``convergence_tol``. Raises CertificateError for numbers that make no sense.
    """

    scale_min: float = 0.01
    scale_max: float = 1.0
    max_iter: int = 10
    convergence_tol: float = 1e-3

    def __post_init__(self) -> None:
        """Raise CertificateError naming the option."""
        if not 0.0 < self.scale_min <= self.scale_max or not math.isfinite(self.scale_max):
            raise CertificateError(
                "scale_min and scale_max must be positive, in this order, not"
                f" {quoted(self.scale_min)} and {quoted(self.scale_max)}"
            )
        if not self.convergence_tol > 0.0:
            raise CertificateError(
                f"convergence_tol must be positive, not {quoted(self.convergence_tol)}"
            )
        _check_iterations(self.max_iter)


@one_line()
@dataclass(frozen=True)
class BilinearAlternationOptions:
    """How a polytope is grown: for how many rounds, until it grows by less than what share.

    ``convergence_tol`` is about the volume of the largest ellipsoid in the polytope; that
    ellipsoid, scaled by ``ellipsoid_scaling``, stays inside, as do ``s_inner_pts`` ``(m, nq)``,
    which must be inside at first. Faces move by ``ellipsoid_margin_cost``. Raises CertificateError
    for numbers that make no sense.
    """

    max_iter: int = 10
    convergence_tol: float = 1e-2
    ellipsoid_scaling: float = 0.99
    ellipsoid_margin_cost: EllipsoidMarginCost = EllipsoidMarginCost.SUM
    ellipsoid_margin_epsilon: float = 1e-5
    s_inner_pts: Sequence[Sequence[float]] = ()

    def __post_init__(self) -> None:
        """Raise CertificateError naming the option."""
        _check_iterations(self.max_iter)
        if not 0.0 <= self.convergence_tol < math.inf:
            raise CertificateError(
                f"convergence_tol must not be negative, not {quoted(self.convergence_tol)}"
            )
        if not 0.0 < self.ellipsoid_scaling <= 1.0:
            raise CertificateError(
                f"ellipsoid_scaling must be in (0, 1], not {quoted(self.ellipsoid_scaling)}"
            )
        if not isinstance(self.ellipsoid_margin_cost, EllipsoidMarginCost):
            raise CertificateError(
                "ellipsoid_margin_cost must be an EllipsoidMarginCost, not"
                f" {quoted(self.ellipsoid_margin_cost)}"
            )
        if not 0.0 < self.ellipsoid_margin_epsilon < math.inf:
            raise CertificateError(
                "ellipsoid_margin_epsilon must be positive, not"
                f" {quoted(self.ellipsoid_margin_epsilon)}"
            )
        points = np.asarray(self.s_inner_pts)
        object.__setattr__(self, "s_inner_pts", tuple(map(tuple, points.tolist())))


def _check_iterations(max_iter: object) -> None:
    if type(max_iter) is not int or max_iter < 0:
        raise CertificateError(
            f"max_iter must be a whole number from 0 on, not {quoted(max_iter)}"
        )
