"""Polytopes that grow: planes for the polytope, then faces for their multipliers, in turn."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
import math

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.convex.errors import SolverError
from scene_graph_ros.convex.sets.affine_ball import AffineBall
from scene_graph_ros.convex.sets.h_polyhedron import HPolyhedron
from scene_graph_ros.planning.certified.growth_program import grown_rows
from scene_graph_ros.planning.certified.pair_problem import PairProblems
from scene_graph_ros.planning.certified.plane_search import plane_for_growth
from scene_graph_ros.planning.certified.polytope_certificate import PolytopeCertificate
from scene_graph_ros.planning.certified.search_options import BilinearAlternationOptions
from scene_graph_ros.planning.certified.tangent_region import TangentRegion

__all__ = ["alternate"]

_WIDENINGS = (0.5, 0.2, 0.05)
"""Of the polytope's width, on both sides: the bounds within which it may grow in one round. Where
planes do not suffice within wide ones, narrower ones are tried."""

_ROUNDING = 1e-6
"""Of a polytope's width, that a solver may move a face by; and of an angle."""

_OUTSIDE = 1e-12
"""Relative, and absolute: how far beyond points that stay inside faces are."""

_STEPS = (1.0, 0.9, 0.5)
"""Shares of a step that are tried until the polytope is proven."""


@dataclass(frozen=True)
class _Ellipsoid:
    """The largest in a polytope."""

    B: NDArray[np.float64]
    center: NDArray[np.float64]

    @classmethod
    def inside(cls, region: TangentRegion) -> _Ellipsoid:
        ball = AffineBall(region.polyhedron.maximum_volume_inscribed_ellipsoid())
        return cls(np.array(ball.B), np.array(ball.center))

    @property
    def log_volume(self) -> float:
        """Less that of the unit ball."""
        return float(np.linalg.slogdet(self.B)[1])


def alternate(
    start: PolytopeCertificate,
    limits: tuple[NDArray[np.float64], NDArray[np.float64]],
    certify: Callable[[TangentRegion], PolytopeCertificate],
    options: BilinearAlternationOptions,
) -> list[PolytopeCertificate]:
    """Return certificates of polytopes, each with a larger ellipsoid in it than the one before.

    ``start`` is the first; it must be a success.
    """
    found = [start]
    inner = _Ellipsoid.inside(start.region)
    for _ in range(options.max_iter):
        after = None
        for share in _WIDENINGS:
            wide = _widened(found[-1].region, limits, share)
            after = _round(found[-1], wide, inner, certify, options)
            if after is not None:
                break
        if after is None:
            break
        grown = _Ellipsoid.inside(after.region)
        gain = math.expm1(grown.log_volume - inner.log_volume)
        if gain <= 0.0:
            break
        found.append(replace(after, num_iter=len(found)))
        inner = grown
        if gain <= options.convergence_tol:
            break
    return found


def _widened(
    region: TangentRegion,
    limits: tuple[NDArray[np.float64], NDArray[np.float64]],
    share: float,
) -> TangentRegion:
    """Return the same region, its bounds as rows, between bounds that are farther out."""
    unit = np.eye(len(region.lower))
    rows = np.concatenate([region.C, unit, -unit])
    sides = np.concatenate([region.d, region.upper, -region.lower])
    is_limit = np.concatenate(
        [
            np.zeros(len(region.d), dtype=np.bool_),
            region.upper >= limits[1],
            region.lower <= limits[0],
        ]
    )
    rows, sides = rows[~is_limit], sides[~is_limit]
    redundant = HPolyhedron(rows, sides).find_redundant()
    kept = [k for k in range(len(sides)) if k not in redundant]
    rows, sides = rows[kept], sides[kept]
    out = share * (region.upper - region.lower)
    lower, upper = (
        np.maximum(region.lower - out, limits[0]),
        np.minimum(region.upper + out, limits[1]),
    )
    lengths = np.linalg.norm(rows, axis=1)
    return TangentRegion(
        lower, upper, rows / lengths[:, np.newaxis], sides / lengths, ties_all=True
    )


def _round(
    before: PolytopeCertificate,
    wide: TangentRegion,
    inner: _Ellipsoid,
    certify: Callable[[TangentRegion], PolytopeCertificate],
    options: BilinearAlternationOptions,
) -> PolytopeCertificate | None:
    """Return a larger polytope that is proven, or None."""
    problems = PairProblems(before.kinematics, before.plan, before.inspector, wide)
    parts = [problems.make(pair) for pair in before.pairs()]
    try:
        solutions = []
        for part in parts:
            solutions.append(plane_for_growth(part, options.find_lagrangian_options.solver))
            if solutions[-1].clearance <= 0.0:
                return None
        B = options.ellipsoid_scaling * inner.B
        C, d = grown_rows(parts, solutions, wide, B, inner.center, options.faces)
        d = _not_moved_back(C, d, before.region)
    except SolverError:
        return None
    for step in _STEPS:
        height = C @ inner.center
        sides = height + step * (d - height)
        for point in options.faces.s_inner_pts:
            reach = C @ np.array(point)
            sides = np.maximum(sides, reach + _OUTSIDE * (1.0 + np.abs(reach)))
        after = certify(TangentRegion(wide.lower, wide.upper, C, sides))
        if after.is_success:
            return after
    return None


def _not_moved_back(
    C: NDArray[np.float64], d: NDArray[np.float64], before: TangentRegion
) -> NDArray[np.float64]:
    """Return sides, where faces that only rounding moves back stay where they were."""
    polytope = before.polyhedron
    lengths = np.linalg.norm(polytope.A, axis=1)
    is_same = C @ (polytope.A.T / lengths) > 1.0 - _ROUNDING**2
    old = np.where(is_same, polytope.b / lengths, np.inf).min(axis=1)
    is_back = (old > d) & (old < d + _ROUNDING * (before.upper - before.lower).max())
    return np.where(is_back, old, d)
