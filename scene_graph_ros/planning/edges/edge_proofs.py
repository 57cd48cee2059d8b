"""Batches of edges between configurations, handed to the kernels that prove them."""

from __future__ import annotations

import threading
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.planning.edges.edge_kernels import prove_edges
from scene_graph_ros.planning.edges.edge_stretches import (
    EdgeRules,
    EdgeScratch,
    FREE,
    new_stretches,
)
from scene_graph_ros.planning.edges.motion_kernels import new_motions
from scene_graph_ros.planning.pairs.checker_plan import CheckerPlan
from scene_graph_ros.planning.parallel.in_threads import in_threads
from scene_graph_ros.planning.parallel.stoppable import new_stop

__all__ = ["EdgeProofs", "EdgeProver", "edge_scratch", "prove"]


class EdgeProofs(NamedTuple):
    """The proofs of edges; see ``prove_edges``."""

    statuses: NDArray[np.int64]
    """``(n,)``: COLLIDES, FREE or UNDECIDED."""
    numbers: NDArray[np.float64]
    """``(n, 4)``: up to where it is proven, where it stops, what is kept, how often it looked."""
    pairs: NDArray[np.int64]
    """``(n,)``: what stops it."""


def edge_scratch(plan: CheckerPlan) -> EdgeScratch:
    """Return the scratch arrays of kernels that prove edges, for one thread."""
    pairs, robots = len(plan.pairs.bodies), len(plan.bodies.joints)
    joints, positions = len(plan.tree.table.kinds), plan.tree.num_positions
    return EdgeScratch(
        new_motions(joints, positions, robots, pairs),
        new_stretches(pairs),
        plan.new_places(),
    )


_kept = threading.local()
"""Of each thread the scratch arrays of the plan that it asked about last: they change seldom."""


def _kept_scratch(plan: CheckerPlan) -> EdgeScratch:
    """Return this thread's scratch arrays for a plan."""
    newest: tuple[CheckerPlan, EdgeScratch] | None = getattr(_kept, "newest", None)
    if newest is None or newest[0] is not plan:
        newest = _kept.newest = plan, edge_scratch(plan)
    return newest[1]


def prove(
    plan: CheckerPlan,
    edges: NDArray[np.float64],
    rules: EdgeRules,
    *,
    threads: int = 1,
    stop: NDArray[np.int64] | None = None,
    scratch: EdgeScratch | None = None,
) -> EdgeProofs:
    """Prove edges ``(n, m, nq)`` of m control points; the same for any number of threads.

    They must have been checked.

    Whoever sets ``stop`` leaves all edges undecided that are not yet proven. ``scratch`` is that
    of `edge_scratch`, for one thread.
    """
    n = len(edges)
    result = EdgeProofs(np.empty(n, np.int64), np.empty((n, 4)), np.empty(n, np.int64))
    flag = new_stop() if stop is None else stop

    def prove_all(one: CheckerPlan, some: NDArray[np.float64], to: Any) -> None:
        own = _kept_scratch(one) if scratch is None or one is not plan else scratch
        prove_edges(one.checked, some, rules, flag, EdgeProofs(*to), own)

    def prove_part(part: slice) -> None:
        to = EdgeProofs(result.statuses[part], result.numbers[part], result.pairs[part])
        if plan.shapes.clouds and not rules.measures:
            from scene_graph_ros.planning.edges.cloud_proofs import prove_with_clouds

            if prove_with_clouds(plan, edges[part], rules, flag, to, prove_all):
                return
        prove_all(plan, edges[part], to)

    in_threads(prove_part, n, threads)
    return result


class EdgeProver:
    """Proves straight edges one after another, in one thread, with arrays that are made once."""

    def __init__(self, plan: CheckerPlan, rules: EdgeRules, stop: NDArray[np.int64]) -> None:
        """Take the arguments of `prove`."""
        self._edge = np.empty((1, 2, plan.tree.num_positions))
        self._proof = EdgeProofs(np.empty(1, np.int64), np.empty((1, 4)), np.empty(1, np.int64))
        self._arguments = (
            plan.checked,
            self._edge,
            rules,
            stop,
            self._proof,
            edge_scratch(plan),
        )

    def is_free(self, first: NDArray[np.float64], second: NDArray[np.float64]) -> bool:
        """Tell whether the edge between two configurations ``(nq,)`` is proven free."""
        self._edge[0, 0], self._edge[0, 1] = first, second
        prove_edges(*self._arguments)
        return bool(self._proof.statuses[0] == FREE)
