"""Batches of edges among clouds that do not move."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.planning.edges.cloud_edges import (
    CloudEdgeScratch,
    MOST_WAITING,
    prove_clouds,
)
from scene_graph_ros.planning.edges.edge_stretches import EdgeRules, FREE, UNDECIDED
from scene_graph_ros.planning.edges.motion_kernels import new_motions
from scene_graph_ros.planning.pairs.check_kernels import NO_PAIR
from scene_graph_ros.planning.pairs.checker_plan import CheckerPlan
from scene_graph_ros.planning.pairs.cloud_pairs import new_scratch, split_of, SplitPlan
from scene_graph_ros.robots.tree_kernels import LANES

__all__ = ["prove_with_clouds"]

_Arrays = tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.int64]]
"""Statuses, numbers and pairs of edges; see ``EdgeProofs``."""
_Prove = Callable[[CheckerPlan, NDArray[np.float64], _Arrays], None]


def prove_with_clouds(
    plan: CheckerPlan,
    edges: NDArray[np.float64],
    rules: EdgeRules,
    stop: NDArray[np.int64],
    proofs: _Arrays,
    prove_all: _Prove,
) -> bool:
    """Write the rows of ``prove`` for edges; tell whether that is so, as some cloud stands still.

    ``prove_all`` takes all pairs alike. It decides edges that yes and no leave undecided.
    """
    split = split_of(plan)
    if split is None:
        return False
    statuses, numbers, pairs = proofs
    prove_all(split.others, edges, proofs)
    is_found = pairs != NO_PAIR
    pairs[is_found] = split.rows[pairs[is_found]]
    was_free = statuses == FREE
    prove_clouds(plan.checked, split.table, edges, rules, stop, proofs, _scratch(plan, split))
    # Of what the others leave undecided, too, a cloud may know that it collides.
    left = np.flatnonzero((statuses == UNDECIDED) & was_free)
    if len(left) and not stop[0]:
        again = statuses[left], numbers[left], pairs[left]
        prove_all(plan, edges[left], again)
        statuses[left], numbers[left], pairs[left] = again
    return True


def _scratch(plan: CheckerPlan, split: SplitPlan) -> CloudEdgeScratch:
    robots, m = len(plan.carried), len(split.table.pairs)
    joints, positions = len(plan.tree.table.kinds), plan.tree.num_positions
    return CloudEdgeScratch(
        new_motions(joints, positions, robots, len(plan.pairs.bodies)),
        plan.new_places(),
        new_scratch(plan),
        np.empty((MOST_WAITING, 2)),
        np.zeros((MOST_WAITING + LANES, m + 1), np.bool_),
        np.empty(LANES),
        np.empty(LANES),
        np.empty(len(split.table.groups), np.int64),
    )
