"""Counting the rows of an answer while it is computed, so that it ends when they are too many."""

from __future__ import annotations

from collections.abc import Callable, Sized
import threading
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from msg_adapters.errors import TooLargeError
from scene_graph_ros.geometry.query.blocks import (
    apart_from_context,
    joined,
    point_distance_blocks,
    signed_distance_blocks,
    widening_distances,
)
from scene_graph_ros.geometry.query.query_object import QueryObject
from scene_graph_ros.geometry.query.results import PointDistances, SignedDistancePairs

__all__ = ["Tally", "points_within", "require", "signed_distances_within"]

Table = TypeVar("Table", bound=Sized)


def require(limit: Callable[[str], Any], parameter: str, count: int, what: str) -> None:
    """Raise TooLargeError where ``count`` is over a limit of the node."""
    most = limit(parameter)
    if count > most:
        raise TooLargeError(f"{what}: {count} are more than {parameter}, which is {most}")


class Tally:
    """Counts the rows of an answer, configuration after configuration, in any thread."""

    def __init__(self, limit: Callable[[str], Any]) -> None:
        self._limit = limit
        self._lock = threading.Lock()
        self.rows = self.faces = 0

    @property
    def most_rows(self) -> int:
        """How many rows an answer may have."""
        return int(self._limit("max_rows_per_response"))

    def add(self, rows: int, faces: int = 0) -> None:
        """Raise TooLargeError as soon as it is too much, before more is computed."""
        with self._lock:
            self.rows += rows
            self.faces += faces
            require(self._limit, "max_rows_per_response", self.rows, "rows of the answer")
            require(self._limit, "max_faces_per_response", self.faces, "faces of the answer")

    def counted(self, table: Table) -> Table:
        """Add a table's rows, and return it."""
        self.add(len(table))
        return table

    def copy(self) -> Tally:
        """Return a tally that goes on from here by itself."""
        result = Tally(self._limit)
        result.rows, result.faces = self.rows, self.faces
        return result


def points_within(
    query: QueryObject, points: NDArray[np.float64], threshold: float, threads: int, tally: Tally
) -> PointDistances:
    """Measure points; raises TooLargeError as soon as the answer has too many rows."""
    blocks = point_distance_blocks(query, points, threshold, rows=tally.most_rows, threads=threads)
    return joined([tally.counted(block) for block in blocks])


def signed_distances_within(
    query: QueryObject, max_distance: float, tally: Tally
) -> SignedDistancePairs:
    """Measure all pairs; raises TooLargeError as soon as the answer has too many rows.

    A distance that nearly all pairs are within is not begun with: their list alone would take
    all memory.
    """
    rows = tally.most_rows
    apart = apart_from_context(query)
    for distance in widening_distances(apart, max_distance):
        attempt = tally.copy()
        for block in signed_distance_blocks(apart, distance, rows=rows):
            attempt.counted(block)
    return joined(
        [tally.counted(b) for b in signed_distance_blocks(apart, max_distance, rows=rows)]
    )
