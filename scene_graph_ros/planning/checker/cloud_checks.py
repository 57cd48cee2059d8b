"""Batches of configurations among clouds that do not move."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.planning.pairs.check_kernels import NO_PAIR
from scene_graph_ros.planning.pairs.checker_plan import CheckerPlan
from scene_graph_ros.planning.pairs.cloud_kernels import check_clouds
from scene_graph_ros.planning.pairs.cloud_pairs import new_scratch, split_of
from scene_graph_ros.planning.parallel.in_threads import in_threads

__all__ = ["first_pairs_with_clouds"]

_First = Callable[[CheckerPlan, NDArray[np.float64], int], NDArray[np.int64]]


def first_pairs_with_clouds(
    plan: CheckerPlan, q: NDArray[np.float64], threads: int, first_of_all: _First
) -> NDArray[np.int64] | None:
    """Return the same as ``first_pairs``, None where no cloud of the plan stands still.

    ``first_of_all`` looks at pairs one by one, as at all others.
    """
    split = split_of(plan)
    if split is None:
        return None
    none, rows = len(plan.pairs.bodies), split.rows
    found = first_of_all(split.others, q, threads)
    first = np.full(len(q), none)
    is_found = found != NO_PAIR
    first[is_found] = rows[found[is_found]]

    def check(part: slice) -> None:
        check_clouds(
            plan.held.places,
            plan.tree.table,
            plan.bodies,
            split.table,
            q[part],
            plan.tree.X_WB,
            first[part],
            plan.new_places(),
            new_scratch(plan),
        )

    in_threads(check, len(q), threads)
    return np.where(first == none, NO_PAIR, first)
