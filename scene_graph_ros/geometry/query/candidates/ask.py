"""Ask which pairs might touch."""

from __future__ import annotations

from scene_graph_ros.geometry.model.snapshot import Snapshot
from scene_graph_ros.geometry.query.candidates.rows import pair_memory
from scene_graph_ros.geometry.query.memo import Memo
from scene_graph_ros.geometry.query.results import CandidatePairs

__all__ = ["find_collision_candidates"]


def find_collision_candidates(memo: Memo) -> CandidatePairs:
    """Answer `QueryObject.find_collision_candidates`."""
    return memo.get("candidates", pairs_of_candidates)


def pairs_of_candidates(snapshot: Snapshot) -> CandidatePairs:
    """Return the pairs whose bounding boxes meet."""
    ids = snapshot.proximity.ids[pair_memory(snapshot).find(snapshot.X_WG, 0.0, is_close=False)]
    return CandidatePairs({"id_A": ids[:, 0], "id_B": ids[:, 1]})
