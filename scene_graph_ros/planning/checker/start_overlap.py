"""The depths of pairs that overlap where a path begins, and the proof of the way out."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.planning.checker.collision_checker import SceneGraphCollisionChecker
from scene_graph_ros.planning.pairs.near_pairs import near_pairs_at

__all__ = ["DEEPER", "StartOverlap", "start_overlap_of"]

DEEPER = 1e-5
"""Metres: on the way out a pair is proven to get no deeper than at the start and this."""


class StartOverlap(NamedTuple):
    """A configuration at which pairs are nearer than their paddings."""

    depth: float
    """Metres: of the deepest pair."""
    rows: NDArray[np.int64]
    """``(k,)``: which pairs, as rows of the plan."""
    checker: SceneGraphCollisionChecker
    """For which such a pair may be as near as it is; all others keep what they have to."""


def start_overlap_of(
    checker: SceneGraphCollisionChecker, q: NDArray[np.float64]
) -> StartOverlap | None:
    """Return the overlaps where a path begins ``(nq,)``; None without any.

    A pair that is apart by less than twice the checker's tolerance counts, as nothing is proven
    of it.
    """
    plan, least = checker.plan, 2.0 * checker.tolerance
    near = near_pairs_at(plan, q[np.newaxis], least)
    is_deep = near.distances < least
    if not is_deep.any():
        return None
    rows, distances = near.rows[is_deep], near.distances[is_deep]
    paddings = plan.pairs.paddings.copy()
    paddings[rows] += np.minimum(distances, 0.0) - DEEPER
    depth = max(-float(distances.min()), 0.0)
    return StartOverlap(depth, rows, checker.with_pair_paddings(paddings))
