"""The record of a region: samples of it, and bounds that follow from them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.convex.sets.h_polyhedron import HPolyhedron
from scene_graph_ros.convex.sets.hyperellipsoid import Hyperellipsoid
from scene_graph_ros.geometry.one_line import one_line

__all__ = ["ConfigurationRegion", "share_bound"]


@one_line()
@dataclass(frozen=True, eq=False)
class ConfigurationRegion:
    """A region of configurations, and the test that it passed."""

    region: HPolyhedron
    ellipsoid: Hyperellipsoid | None
    """The largest in the region; None where that is too thin for one."""
    samples: int
    """Points of the region that the test asked about, by hit and run."""
    hits: int
    """Those that are not free."""
    share_bound: float
    """What the share of the region that is not free is at most, at ``confidence``."""
    confidence: float
    """Of the statement, as if points were independent; all tests until this one are counted."""
    tests: int
    """How many tests there were."""
    kept: NDArray[np.float64]
    """``(k, n)``: points that are certainly inside."""
    volumes: tuple[float, ...]
    """Of the largest ellipsoid in each region that passed; ``region`` has the largest of these."""
    reason: str
    """Why growing ended: ``converged``, ``iterations``, ``thin``, ``center`` (that of the next
    ellipsoid is not free), ``test`` (the next region did not pass), ``termination_func``,
    ``timeout``."""


def share_bound(samples: int, hits: int, error: float) -> float:
    """Return an upper bound of a share of which ``samples`` have ``hits``: but for ``error``.

    Clopper and Pearson, "The use of confidence or fiducial limits illustrated in the case of the
    binomial", Biometrika 26, 1934.
    """
    from scipy.special import betaincinv

    if hits >= samples:
        return 1.0
    return float(betaincinv(hits + 1, samples - hits, 1.0 - error))
