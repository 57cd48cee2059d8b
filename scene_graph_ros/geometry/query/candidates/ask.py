"""Ask which pairs might touch."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.model.snapshot import Snapshot
from scene_graph_ros.geometry.query.candidates.rows import pair_memory
from scene_graph_ros.geometry.query.memo import Memo
from scene_graph_ros.geometry.query.on_demand import on_demand
from scene_graph_ros.geometry.query.results import CandidatePairs, LateColumns

__all__ = ["find_collision_candidates"]

_Answers = tuple[NDArray[np.int64], NDArray[np.int64]]
"""Ids (n,), and pairs of their rows (k, 2)."""


def find_collision_candidates(memo: Memo) -> CandidatePairs:
    """Answer `QueryObject.find_collision_candidates`."""
    return memo.get("candidates", pairs_of_candidates)


def pairs_of_candidates(snapshot: Snapshot) -> CandidatePairs:
    """Return the pairs whose bounding boxes meet."""
    rows = pair_memory(snapshot).find(snapshot.X_WG, 0.0, is_close=False)
    proximity = snapshot.proximity
    late = LateColumns(_COLUMNS, (proximity.ids, rows), len(rows))
    table = CandidatePairs(late, snapshot.state)
    if proximity.has_elements:
        table = on_demand("candidates_with_elements")(snapshot, table)
    return table


_COLUMNS: Mapping[str, Callable[[_Answers], NDArray[np.int64]]] = {
    "id_A": lambda answers: answers[0][answers[1][:, 0]],
    "id_B": lambda answers: answers[0][answers[1][:, 1]],
}
