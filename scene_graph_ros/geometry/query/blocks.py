"""Answers of many rows, block by block: whoever asks can stop when it has enough.

A query with a finite limit of distance answers with as many rows as there happen to be. Here no
more than a block of them is computed at a time.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
import math
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.model.memory import Memory
from scene_graph_ros.geometry.model.snapshot import Snapshot
from scene_graph_ros.geometry.query.candidates.rows import candidate_rows
from scene_graph_ros.geometry.query.distance.ask import distances_of_pairs
from scene_graph_ros.geometry.query.on_demand import on_demand
from scene_graph_ros.geometry.query.query_object import QueryObject
from scene_graph_ros.geometry.query.results import (
    PointDistances,
    ResultTable,
    SignedDistancePairs,
)
from scene_graph_ros.geometry.query.settings import Settings
from scene_graph_ros.geometry.spatial.sums import length

__all__ = [
    "apart_from_context",
    "joined",
    "point_distance_blocks",
    "signed_distance_blocks",
    "widening_distances",
]

Table = TypeVar("Table", bound=ResultTable[Any])

_HALVINGS = 6
"""An eighth of the pairs for each halving of the distance: from 1e9 of them to some thousands."""


def point_distance_blocks(
    query: QueryObject,
    p_WQs: NDArray[np.float64],
    threshold: float,
    *,
    rows: int,
    threads: int = 1,
) -> Iterator[PointDistances]:
    """Yield the answers of ``compute_signed_distance_to_points``, some points at a time.

    A table has at most ``rows`` >= 1 rows, or those of one point.
    """
    size = max(rows // max(len(query.snapshot.proximity.ids), 1), 1)
    for start in range(0, max(len(p_WQs), 1), size):
        points = p_WQs[start : start + size]
        table = query.compute_signed_distance_to_points(points, threshold, threads=threads)
        columns = {**table.columns, "point": table.point + start}
        yield PointDistances(columns, query.snapshot.state)


def signed_distance_blocks(
    query: QueryObject, max_distance: float, *, rows: int
) -> Iterator[SignedDistancePairs]:
    """Yield the answers of ``compute_signed_distance_pairwise_closest_points``, in order.

    A table is of at most ``rows`` >= 1 pairs that may be near enough. Pairs of shapes of many
    elements come last.
    """
    snapshot = query.snapshot
    settings = Settings(query.accuracy, query.engine)
    pairs = candidate_rows(snapshot, max(max_distance, 0.0))
    for start in range(0, max(len(pairs), 1), rows):
        some = pairs[start : start + rows]
        yield distances_of_pairs(snapshot, some, max_distance, settings)
    if snapshot.proximity.has_elements:
        none = distances_of_pairs(snapshot, pairs[:0], max_distance, settings)
        yield on_demand("distances_with_elements")(snapshot, none, max_distance, settings)


def joined(tables: Sequence[Table]) -> Table:
    """Put one table or more of a kind behind one another."""
    if len(tables) == 1:
        return tables[0]
    names = dict.fromkeys(name for table in tables for name in table.columns)
    columns = {name: np.concatenate([getattr(t, name) for t in tables]) for name in names}
    if "element_A" in columns:  # what has elements came last
        order = np.lexsort([columns["id_B"], columns["id_A"]])
        columns = {name: column[order] for name, column in columns.items()}
    return type(tables[0])(columns)


def widening_distances(query: QueryObject, max_distance: float) -> Iterator[float]:
    """Yield growing distances below ``max_distance``, from where few pairs are as near.

    Pairs within a smaller distance are among those within a larger one. A caller that finds too
    many of them need not look for more, nor have the memory for them.
    """
    p_WG = query.snapshot.X_WG[:, :3, 3]
    extent = length(np.ptp(p_WG, axis=0)) if len(p_WG) else 0.0
    if extent > 0.0 and math.isfinite(extent):
        for halvings in range(_HALVINGS, -1, -1):
            distance = extent * 0.5**halvings
            if distance < max_distance:
                yield distance


def apart_from_context(query: QueryObject) -> QueryObject:
    """Return the same moment with a memory of its own, which searches for pairs may fill."""
    snapshot: Snapshot = query.snapshot.with_frame_poses({}, memory=Memory())
    return QueryObject(snapshot)
