"""Ways that are not straight, as straight pieces of which each is proven."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.planning.edges.edge_measure import EdgeMeasure, EdgeStatus
from scene_graph_ros.planning.edges.edge_stretches import COLLIDES, FREE, UNDECIDED

__all__ = ["Ways", "joined_measures", "joined_statuses"]


class Ways(NamedTuple):
    """The pieces of ways, one after the other."""

    pieces: NDArray[np.float64]
    """``(k, 2, nq)``."""
    starts: NDArray[np.intp]
    """``(n + 1,)``: the first piece of each way, which has one at least, and of none."""

    @classmethod
    def of(cls, ways: Sequence[NDArray[np.float64]]) -> Ways:
        """Return the pieces between the configurations of each way ``(m, nq)``; one at least."""
        counts = [len(way) - 1 for way in ways]
        pieces = [np.stack([way[:-1], way[1:]], axis=1) for way in ways]
        starts = np.concatenate([[0], np.cumsum(counts, dtype=np.intp)]).astype(np.intp)
        return cls(np.concatenate(pieces), starts)


def joined_statuses(statuses: NDArray[np.int64], ways: Ways) -> NDArray[np.int64]:
    """Return the status of each curve: that one of its pieces collides, or is not proven."""
    result = np.full(len(ways.starts) - 1, FREE, dtype=np.int64)
    for status in (UNDECIDED, COLLIDES):
        found = np.concatenate([[0], np.cumsum(statuses == status)])[ways.starts]
        result[np.diff(found) > 0] = status
    return result


def joined_measures(measures: Sequence[EdgeMeasure], ways: Ways) -> list[EdgeMeasure]:
    """Return the measure of each curve; its pieces have equal parts of ``alpha``.

    ``alpha`` ends at the first piece which is not. If one collides, the first of these is told of.
    """
    return [
        _joined(measures[first:last])
        for first, last in zip(ways.starts[:-1], ways.starts[1:], strict=True)
    ]


def _joined(pieces: Sequence[EdgeMeasure]) -> EdgeMeasure:
    distance = sum(each.distance for each in pieces)
    stopped = [row for row, each in enumerate(pieces) if not each.completely_free]
    if not stopped:
        least = min(each.least_clearance for each in pieces)
        return EdgeMeasure(distance, 1.0, EdgeStatus.FREE, least, None, None, None)
    first = stopped[0]
    colliding = [row for row in stopped if pieces[row].status is EdgeStatus.COLLIDES]
    told = (colliding or stopped)[0]
    begins_free = first > 0 or pieces[0].partially_free
    at = pieces[told].at
    return EdgeMeasure(
        distance=distance,
        alpha=(first + pieces[first].alpha_or(0.0)) / len(pieces) if begins_free else -1.0,
        status=pieces[told].status,
        least_clearance=0.0,
        configuration=pieces[told].configuration,
        pair=pieces[told].pair,
        at=None if at is None else (told + at) / len(pieces),
    )
