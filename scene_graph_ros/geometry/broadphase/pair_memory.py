"""What a context remembers of its last search for candidates: little motion, little work."""

from __future__ import annotations

import math
import threading
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.broadphase.aabb import box_geometry, place_rows
from scene_graph_ros.geometry.broadphase.hierarchical_grid import candidate_pairs
from scene_graph_ros.geometry.broadphase.separating_axes import drop_separated
from scene_graph_ros.geometry.broadphase.tracking import Bodies, Tracker
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.tables.table_arrays import ShapeTable

__all__ = ["PairMemory"]

Pairs = NDArray[np.int64]
MAX_MARGINS = 4
"""Margins are asked for again and again; the memory of the one not used longest is given up."""


class PairMemory:
    """Finds candidate pairs of one model, in poses that follow each other.

    Any number of threads may ask; who finds another at work searches without the memory. The
    answer does not depend on what was asked before.
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
        self._lock = threading.Lock()
        self._trackers: dict[float, Tracker] = {}
        self._tracker: Tracker
        """The one used last."""
        self._margin = math.nan
        """Its margin; nan while there is none."""

    def find(self, X_WG: NDArray[np.float64], margin: float, *, is_close: bool) -> Pairs:
        """Return the sorted (k, 2) rows of pairs whose boxes come within a finite ``margin``.

        With ``is_close`` those are left out that ``drop_separated`` shows to be further apart.
        """
        if not self._lock.acquire(False):
            return self._search(X_WG, margin, is_close)
        try:
            if margin != self._margin:
                self._choose(margin)
            return self._tracker.find(X_WG, is_close)
        finally:
            self._lock.release()

    def _choose(self, margin: float) -> None:
        """Use the tracker for a margin, which comes last then."""
        self._margin = math.nan  # who is interrupted here chooses anew
        trackers = self._trackers
        tracker = trackers.pop(margin, None) or Tracker(self._bodies, margin)
        while len(trackers) >= MAX_MARGINS:
            del trackers[next(iter(trackers))]
        self._tracker = trackers[margin] = tracker
        self._margin = margin

    def _search(self, X_WG: NDArray[np.float64], margin: float, is_close: bool) -> Pairs:
        """Do without the memory."""
        bodies = self._bodies
        placed = place_rows(bodies.geometry, X_WG)
        lower, upper = (
            np.ascontiguousarray(corners[:, :3]) for corners in (placed.lower, placed.upper)
        )
        found: Pairs = candidate_pairs(
            lower, upper, bodies.is_half_space, X_WG, bodies.frame, bodies.filter_bits, margin
        )
        if not is_close:
            return found
        count = drop_separated(
            bodies.geometry.extents, placed.centre, X_WG, found, len(found), margin
        )
        return found[:count]

    def counters(self, margin: float) -> NDArray[np.int64]:
        """Return what was done so far for a margin: see ``tracking.COUNTERS``."""
        return self._trackers[margin].counters
