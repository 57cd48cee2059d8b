"""Batches of configurations, handed to the kernel that checks them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.planning.pairs.check_kernels import check_by_tree, check_configurations
from scene_graph_ros.planning.pairs.checker_plan import CheckerPlan
from scene_graph_ros.planning.parallel.in_threads import in_threads

__all__ = ["first_of_all", "first_pairs"]


def first_pairs(plan: CheckerPlan, q: NDArray[np.float64], threads: int) -> NDArray[np.int64]:
    """Return a pair (row of the plan) of each of ``q (n, nq)`` that is too near, or NO_PAIR.

    The same for any number of threads. Configurations must have been checked.
    """
    if plan.shapes.clouds:
        from scene_graph_ros.planning.checker.cloud_checks import first_pairs_with_clouds

        found = first_pairs_with_clouds(plan, q, threads, first_of_all)
        if found is not None:
            return found
    return first_of_all(plan, q, threads)


def first_of_all(plan: CheckerPlan, q: NDArray[np.float64], threads: int) -> NDArray[np.int64]:
    """Return the same, of pairs that are all looked at alike."""
    result = np.empty(len(q), dtype=np.int64)
    kernel = check_by_tree if len(plan.bodies.nodes.radii) else check_configurations

    def check(part: slice) -> None:
        places = plan.new_places()
        kernel(
            plan.held.places,
            plan.tree.table,
            plan.bodies,
            plan.pairs,
            q[part],
            plan.tree.X_WB,
            result[part],
            places,
        )

    in_threads(check, len(q), threads)
    return result
