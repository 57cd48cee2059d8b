"""Which triangles meet at which edge.

Half edge 3 t + k runs from corner k to corner k+1 of triangle t.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["Edges", "edges_of", "mates_of", "open_half_edges"]

IntArray = NDArray[np.int64]
_LARGEST = 3_000_000_000
"""Pairs of indices below this one are numbers of 63 bits."""


class Edges(NamedTuple):
    """The half edges of triangles, sorted by the edge that they are on."""

    start: IntArray
    """(3 m,): the vertex that each half edge begins at."""
    end: IntArray
    """(3 m,)."""
    order: IntArray
    """(3 m,): half edges, those of one edge beside each other, ascending."""
    first: IntArray
    """(e + 1,): edge i has half edges ``order[first[i]:first[i + 1]]``."""

    @property
    def counts(self) -> IntArray:
        """(e,): how many triangles meet at each edge."""
        return np.diff(self.first)

    @property
    def balances(self) -> IntArray:
        """(e,): how much more often triangles run to the higher vertex than to the lower one."""
        ways = np.where(self.start < self.end, 1, -1)[self.order]
        sums = np.concatenate([[0], np.cumsum(ways)])
        return np.asarray(np.diff(sums[self.first]))

    def rows(self) -> IntArray:
        """Return (3 m,): the edge of each half edge."""
        result = np.empty(len(self.order), dtype=np.int64)
        result[self.order] = np.repeat(np.arange(len(self.first) - 1), self.counts)
        return result


def edges_of(triangles: IntArray) -> Edges:
    """Return the edges of (m, 3) triangles."""
    start = triangles.reshape(-1)
    end = np.roll(triangles, -1, axis=1).reshape(-1)
    count = int(triangles.max(initial=0)) + 1
    assert count < _LARGEST  # no file has as many vertices
    key = np.minimum(start, end) * count + np.maximum(start, end)
    order = np.argsort(key, kind="stable")
    key = key[order]
    is_first = np.ones(len(order) + 1, dtype=bool)
    is_first[1:-1] = key[1:] != key[:-1]
    return Edges(start, end, order, np.flatnonzero(is_first))


def mates_of(edges: Edges) -> IntArray:
    """Return (3 m,): the other half edge of an edge of two triangles, and -1 at other edges."""
    mate = np.full(len(edges.order), -1, dtype=np.int64)
    pairs = edges.first[:-1][edges.counts == 2]
    one, other = edges.order[pairs], edges.order[pairs + 1]
    mate[one], mate[other] = other, one
    return mate


def open_half_edges(triangles: IntArray, *, by_ways: bool = False) -> tuple[IntArray, IntArray]:
    """Return the ends (k, 2) of half edges where an odd number of triangles meet, and rows.

    With ``by_ways`` those where triangles run more often one way than the other.
    """
    edges = edges_of(triangles)
    is_open = edges.balances != 0 if by_ways else edges.counts % 2 == 1
    half = np.sort(edges.order[np.repeat(is_open, edges.counts)])
    return np.stack([edges.start[half], edges.end[half]], axis=1), half
