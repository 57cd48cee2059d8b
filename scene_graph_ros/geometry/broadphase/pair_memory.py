"""What a context remembers of its last search for candidates: little motion, little work."""

from __future__ import annotations

import threading
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.broadphase.aabb import box_geometry, CORNER, world_boxes
from scene_graph_ros.geometry.broadphase.extents import centres_of
from scene_graph_ros.geometry.broadphase.hierarchical_grid import candidate_pairs
from scene_graph_ros.geometry.broadphase.separating_axes import drop_separated
from scene_graph_ros.geometry.broadphase.tracking import COUNTERS, track
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.tables.shape_table import ShapeTable

__all__ = ["PairMemory"]

Pairs = NDArray[np.int64]
MAX_MARGINS = 4
"""Margins are asked for again and again; the memory of the one not used longest is given up."""


class _Tracker:
    """The arrays of ``track`` for one margin."""

    def __init__(self, n: int) -> None:
        self.pairs = np.empty((0, 2), np.int64)
        self.is_new = True
        self.memory = (
            np.full((n, 4, 4), np.nan),
            np.zeros((n, CORNER)),
            np.zeros((n, CORNER)),
            np.zeros((6, n)),
            np.zeros(n),
            np.zeros(n, np.bool_),
            np.zeros(n + 1, np.int64),
            np.zeros(COUNTERS, np.int64),
        )


class PairMemory:
    """Finds candidate pairs of one model, in poses that follow each other.

    Any number of threads may ask; who finds another at work searches without the memory. The
    answer does not depend on what was asked before.
    """

    def __init__(self, table: ShapeTable, frame: NDArray[np.int32], filter_bits: Any) -> None:
        """Take a model of n rows, as ``candidate_pairs`` does."""
        self._table = table
        self._geometry = box_geometry(table)
        self._centres = centres_of(table)
        self._frame = frame
        self._filter_bits = filter_bits
        self._is_half_space = table.kind == ShapeKind.HALF_SPACE
        self._all_rows = np.arange(len(frame))
        self._moving_rows = np.flatnonzero(frame != 0)
        self._lock = threading.Lock()
        self._trackers: dict[float, _Tracker] = {}

    def candidate_pairs(self, X_WG: NDArray[np.float64], margin: float) -> Pairs:
        """Return the sorted (k, 2) rows of pairs whose boxes come within a finite ``margin``."""
        if not self._lock.acquire(blocking=False):
            return self._search(X_WG, margin)
        try:
            return self._track(X_WG, margin)
        finally:
            self._lock.release()

    def close_pairs(self, X_WG: NDArray[np.float64], margin: float) -> Pairs:
        """Return the candidate pairs, less those that are soon seen to be further apart."""
        pairs: Pairs = self.candidate_pairs(X_WG, margin)
        if len(pairs):
            pairs = drop_separated(self._geometry[0], self._centres, X_WG, pairs, margin)
        return pairs

    def counters(self, margin: float) -> NDArray[np.int64]:
        """Return what was done so far for a margin: see ``tracking.COUNTERS``."""
        return self._trackers[margin].memory[-1].copy()

    def _search(self, X_WG: NDArray[np.float64], margin: float) -> Pairs:
        lower, upper = world_boxes(self._table, X_WG)
        found: Pairs = candidate_pairs(
            lower, upper, self._is_half_space, X_WG, self._frame, self._filter_bits, margin
        )
        return found

    def _track(self, X_WG: NDArray[np.float64], margin: float) -> Pairs:
        tracker = self._trackers.pop(margin, None) or _Tracker(len(self._frame))
        rows = self._all_rows if tracker.is_new else self._moving_rows
        tracker.pairs, found = track(
            self._geometry, X_WG, rows, self._is_half_space, self._frame, self._filter_bits,
            margin, tracker.memory, tracker.pairs, tracker.is_new,
        )  # fmt: skip
        tracker.is_new = False
        while len(self._trackers) >= MAX_MARGINS:
            del self._trackers[next(iter(self._trackers))]
        self._trackers[margin] = tracker  # the last one used comes last
        return found
