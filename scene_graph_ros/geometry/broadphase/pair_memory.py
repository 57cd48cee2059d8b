"""A context's memory of its last search for candidates: little motion, little work."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.broadphase.aabb import box_geometry
from scene_graph_ros.geometry.broadphase.tracking import Bodies, Tracker
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.tables.table_arrays import ShapeTable

__all__ = ["PairMemory"]

Pairs = NDArray[np.int64]
MAX_MARGINS = 4
"""Margins are asked for again and again; the memory of the one not used longest is given up."""


class PairMemory:
    """Finds candidate pairs of one model, in poses that follow each other.

    Any number of threads may ask. A search takes the margin's tracker away, and puts it back when
    there is an answer: others at work meanwhile begin one of their own, and one that was
    interrupted is not asked again. The answer does not depend on what was asked before.
    """

    def __init__(self, table: ShapeTable, frame: NDArray[np.int32], filter_bits: Any) -> None:
        """Take a model of n rows, as ``candidate_pairs`` does."""
        self._bodies = Bodies(
            box_geometry(table),
            moving=np.flatnonzero(frame != 0),
            is_half_space=table.kind == ShapeKind.HALF_SPACE,
            frame=frame,
            filter_bits=filter_bits,
        )
        self._trackers: dict[float, Tracker] = {}
        """By margins; the one used last comes last."""

    def find(self, X_WG: NDArray[np.float64], margin: float, *, is_close: bool) -> Pairs:
        """Return the sorted (k, 2) rows of pairs whose boxes come within a finite ``margin``.

        With ``is_close`` those are left out that ``drop_separated`` shows to be further apart.
        """
        trackers = self._trackers
        tracker = trackers.pop(margin, None)
        if tracker is None:
            tracker = Tracker(self._bodies, margin)
        pairs = tracker.find(X_WG, is_close)
        trackers[margin] = tracker
        if len(trackers) > MAX_MARGINS:
            self._give_up()
        return pairs

    def _give_up(self) -> None:
        """Forget the margins that were not used longest."""
        for margin in list(self._trackers)[:-MAX_MARGINS]:
            self._trackers.pop(margin, None)

    def counters(self, margin: float) -> NDArray[np.int64]:
        """Return counts of the work so far for a margin: see ``tracking.COUNTERS``."""
        return self._trackers[margin].counters
