"""Ellipsoids and faces around them in turn, until the ellipsoid does not grow any more."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.convex.errors import ConvexSetError, SolverError
from scene_graph_ros.convex.questions.axes import unit_ball_volume
from scene_graph_ros.convex.questions.ellipsoids import Extremal, inscribed
from scene_graph_ros.convex.sets.affine_ball import AffineBall
from scene_graph_ros.convex.sets.h_polyhedron import HPolyhedron
from scene_graph_ros.convex.sets.hyperellipsoid import Hyperellipsoid
from scene_graph_ros.planning.errors import OutOfTimeError
from scene_graph_ros.planning.regions.errors import RegionNotFoundError
from scene_graph_ros.planning.regions.feasibility import Feasibility
from scene_graph_ros.planning.regions.region_record import ConfigurationRegion

__all__ = ["Attempt", "grow", "rounding_shape"]

_ENOUGH = 1e-6
"""Of the log volume of an ellipsoid around which the next region grows."""

_ROUND = 1e-2
"""Of that of one that only says which way a set is long."""


@dataclass(frozen=True, eq=False)
class Attempt:
    """A region around one ellipsoid, and the test that it passed."""

    region: HPolyhedron
    samples: int
    hits: int
    share_bound: float
    confidence: float
    tests: int


def grow(
    feasibility: Feasibility,
    B: NDArray[np.float64],
    center: NDArray[np.float64],
    kept: NDArray[np.float64],
    options: Any,
    most: int,
    attempt: Callable[[NDArray[np.float64], NDArray[np.float64]], Attempt],
) -> ConfigurationRegion:
    """Return the largest region that passed, of at most so many ellipsoids; the first must pass.

    Regions are compared by the volumes of their inscribed ellipsoids. ``options`` has both
    termination thresholds and maybe a ``termination_func``. Raises OutOfTimeError where the time
    is over before a region passed.
    """
    best: Attempt | None = None
    of_best: Extremal | None = None
    volumes: list[float] = []
    reason = ""
    while not reason:
        try:
            if best is not None and not feasibility.free(center[np.newaxis])[0]:
                reason = "center"
                break
            tried = attempt(B, center)
        except (RegionNotFoundError, OutOfTimeError) as error:
            if best is None:
                raise
            reason = "test" if isinstance(error, RegionNotFoundError) else "timeout"
            break
        region = tried.region.reduce_inequalities()
        if _is_ended_by_caller(options, region):
            if best is None:
                raise RegionNotFoundError(
                    "termination_func is true of the first region already, so that there is none"
                    " to return"
                )
            reason = "termination_func"
            break
        passed = Attempt(region, *(getattr(tried, name) for name in _TEST))
        try:
            found = inscribed(region, _ENOUGH)
        except (ConvexSetError, SolverError):
            best = best or passed
            reason = "thin"
            break
        B, center = found.B, found.center
        volume = unit_ball_volume(len(center)) * abs(float(np.linalg.det(B)))
        if volume > max(volumes, default=0.0) or best is None:
            best, of_best = passed, found
        volumes.append(volume)
        reason = _reason_to_end(options, volumes, most)
    assert best is not None
    ellipsoid = None if of_best is None else Hyperellipsoid(AffineBall(of_best.B, of_best.center))
    test = {name: getattr(best, name) for name in _TEST}
    return ConfigurationRegion(
        best.region, ellipsoid, **test, kept=kept, volumes=tuple(volumes), reason=reason
    )


def _is_ended_by_caller(options: Any, region: HPolyhedron) -> bool:
    stop = getattr(options, "termination_func", None)
    return stop is not None and bool(stop(region))


def _reason_to_end(options: Any, volumes: Sequence[float], most: int) -> str:
    """Return why no further ellipsoid is tried, by the volumes so far; empty where one is."""
    so_far = max(volumes[:-1], default=0.0)
    growth = volumes[-1] - so_far
    least, share = options.termination_threshold, options.relative_termination_threshold
    is_small = (growth <= least and least >= 0.0) or (growth <= share * so_far and share >= 0.0)
    if len(volumes) > 1 and is_small:
        return "converged"
    return "iterations" if len(volumes) >= most else ""


def rounding_shape(A: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the map ``(n, n)`` of the largest ellipsoid in ``A x <= b``.

    Walks along its directions mix as fast in thin sets as in round ones, where others hardly move
    and a test of their points would say nothing. Raises RegionNotFoundError for a set that is too
    thin.
    """
    region = HPolyhedron(A, b)
    try:
        return inscribed(region, _ROUND).B
    except (ConvexSetError, SolverError) as error:
        raise RegionNotFoundError(
            f"what is left of the region is too thin for floats to know its ellipsoid ({error});"
            " begin farther from what is not free"
        ) from None


_TEST = ("samples", "hits", "share_bound", "confidence", "tests")
