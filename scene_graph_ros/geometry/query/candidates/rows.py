"""The pairs of rows that may be near enough to matter, by the broad phase."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.broadphase.aabb import world_boxes
from scene_graph_ros.geometry.broadphase.all_pairs import all_candidate_pairs
from scene_graph_ros.geometry.broadphase.pair_memory import PairMemory
from scene_graph_ros.geometry.model.proximity import ProximityArrays
from scene_graph_ros.geometry.model.snapshot import Snapshot
from scene_graph_ros.geometry.shapes.kinds import ShapeKind

__all__ = ["candidate_rows", "pair_memory"]

_NO_FILTERS = np.zeros((0, 0), dtype=np.uint8)


def candidate_rows(snapshot: Snapshot, margin: float) -> NDArray[np.int64]:
    """Return the (k, 2) rows of pairs that may come within ``margin`` >= 0, may be infinite."""
    X_WG = snapshot.X_WG
    if math.isfinite(margin):
        return pair_memory(snapshot).find(X_WG, margin, is_close=True)
    proximity = snapshot.proximity
    lower, upper = world_boxes(proximity.table, X_WG)
    bits = _NO_FILTERS if proximity.filter_bits is None else proximity.filter_bits
    is_half_space = proximity.table.kind == ShapeKind.HALF_SPACE
    rows: NDArray[np.int64] = all_candidate_pairs(
        lower, upper, is_half_space, X_WG, proximity.frame, bits, margin
    )
    return rows


def pair_memory(snapshot: Snapshot) -> PairMemory:
    """Return the memory of a snapshot's context, begun anew after a change of its model."""
    return snapshot.memory.of(_begin_pairs, snapshot.proximity)


def _begin_pairs(proximity: ProximityArrays) -> PairMemory:
    bits = _NO_FILTERS if proximity.filter_bits is None else proximity.filter_bits
    return PairMemory(proximity.table, proximity.frame, bits)
