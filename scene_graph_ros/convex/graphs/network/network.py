"""A graph's edges as numbers: those on a simple path, and shortest paths along weights."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import functools
import heapq
import itertools

import numpy as np

from scene_graph_ros.convex.graphs.network.network_kernels import (
    edges_on_simple_paths,
    few_simple_paths,
    strong_components,
)

__all__ = ["Network", "TwoCycle"]

_FEW = 8
"""How often each vertex is looked at, on average, before all are looked at in turn."""


@dataclass(frozen=True)
class TwoCycle:
    """The edges between a vertex and a neighbour, of which a simple path takes one at most."""

    vertex: int
    into: tuple[int, ...]
    """Those from the neighbour."""
    back: tuple[int, ...]
    """Those to it."""


@dataclass(frozen=True, eq=False)
class Network:
    """Edges ``tails (m,)`` to ``heads (m,)`` among ``size`` vertices, from source to target.

    Vertices with the same ``origin``, by default each its own, are parts of one: no simple path
    goes from one of them to another.
    """

    size: int
    tails: np.ndarray
    heads: np.ndarray
    source: int
    target: int
    origin: Sequence[int] = ()

    def __post_init__(self) -> None:
        """Give vertices their own origins, if none are given."""
        object.__setattr__(self, "origin", self.origin or range(self.size))

    @functools.cached_property
    def leaving(self) -> list[list[int]]:
        """The edges out of each vertex."""
        return self._at(self.tails)

    @functools.cached_property
    def entering(self) -> list[list[int]]:
        """The edges into each vertex."""
        return self._at(self.heads)

    def _at(self, ends: np.ndarray) -> list[list[int]]:
        found: list[list[int]] = [[] for _ in range(self.size)]
        for e, v in enumerate(ends.tolist()):
            found[v].append(e)
        return found

    def take(self, some: np.ndarray) -> Network:
        """Return some of the edges ``(k,)`` among the same vertices."""
        ends = self.tails[some], self.heads[some]
        return Network(self.size, *ends, self.source, self.target, self.origin)

    def without_others(self) -> tuple[Network, np.ndarray]:
        """Return all edges among the vertices ``(n,)`` that they touch, and these."""
        is_touched = np.zeros(self.size, dtype=bool)
        is_touched[[self.source, self.target]] = True
        is_touched[self.tails] = is_touched[self.heads] = True
        place = np.cumsum(is_touched) - 1
        ends = place[self.tails], place[self.heads]
        around = int(place[self.source]), int(place[self.target])
        return Network(int(is_touched.sum()), *ends, *around), np.flatnonzero(is_touched)

    @functools.cached_property
    def ways_on(self) -> dict[int, int]:
        """Edges that all paths come to by one other edge, and only they go on from: that edge.

        They meet at a vertex that has no other edges. In the order of a walk: each is behind the
        one before it, if that is among them.
        """
        after = {
            into[0]: out[0]
            for v, (into, out) in enumerate(zip(self.entering, self.leaving, strict=True))
            if len(into) == len(out) == 1 and v not in (self.source, self.target)
        }
        behind = set(after.values())
        found = {}
        # Circles to which nothing leads are begun nowhere, and stay as they are.
        for e in [e for e in after if e not in behind]:
            while e in after:
                found[after[e]] = e
                e = after[e]
        return found

    def on_simple_paths(self) -> np.ndarray:
        """Return edges ``(k,)`` without those that are seen to be on no simple path.

        An edge is on none where its tail is not reached, its head does not reach the target, every
        way to the tail leads through the head, or every way on from the head through the tail
        (Lengauer and Tarjan, "A fast algorithm for finding dominators in a flowgraph", 1979, on
        dominators; found as in Cooper, Harvey and Kennedy, "A simple, fast dominance
        algorithm", 2001). And where it is on no simple path even if edges may be taken either
        way, which the blocks of the graph tell (Hopcroft and Tarjan, "Algorithm 447", 1973). Time
        is nearly linear; some such edges may stay.
        """
        return edges_on_simple_paths(self.size, self.tails, self.heads, self.source, self.target)

    def few_paths(self, most_looks: int, most_edges: int) -> list[tuple[int, ...]] | None:
        """Return all simple paths, as tuples of edges; None where they are too many.

        That is where looking at ``most_looks`` edges does not find them, or where they have more
        than ``most_edges`` together.
        """
        ends = self.tails, self.heads, self.source, self.target
        edges, last, are_all = few_simple_paths(self.size, *ends, most_looks, most_edges)
        if not are_all:
            return None
        numbers, stops = edges.tolist(), [0, *last.tolist()]
        return [tuple(numbers[a:b]) for a, b in itertools.pairwise(stops)]

    def two_cycles(self, flows: np.ndarray | None = None, least: float = 0.0) -> list[TwoCycle]:
        """Return those at each vertex but source and target.

        With ``flows (m,)`` those around which there is more than the least, each way.
        """
        tails, heads, size, m = self.tails, self.heads, self.size, len(self.tails)
        origin = np.asarray(self.origin, dtype=np.int64)
        keys = np.append(heads * size + origin[tails], tails * size + origin[heads])
        found, which = np.unique(keys, return_inverse=True)
        both, given = (which[:m], which[m:]), np.ones(m) if flows is None else flows
        into, back = (np.bincount(each, given, len(found)) for each in both)
        at = found // size
        is_inner = (at != self.source) & (at != self.target)
        numbers = np.flatnonzero((into > least) & (back > least) & is_inner)
        if not len(numbers):
            return []
        edges = []
        for each in both:
            order = np.argsort(each, kind="stable")
            ends = (np.searchsorted(each[order], numbers, side) for side in ("left", "right"))
            edges.append([tuple(order[a:b].tolist()) for a, b in zip(*ends, strict=True)])
        return [TwoCycle(*each) for each in zip(at[numbers].tolist(), *edges, strict=True)]

    def distances(self, weights: np.ndarray, *, to_target: bool = False) -> list[float]:
        """Return the least sums of weights, at least 0 each, from the source or to the target."""
        start = self.target if to_target else self.source
        edges_of = self.entering if to_target else self.leaving
        ends = (self.tails if to_target else self.heads).tolist()
        lengths = weights.tolist()
        found = [np.inf] * self.size
        found[start] = 0.0
        queue = [(0.0, start)]
        while queue:
            so_far, u = heapq.heappop(queue)
            if so_far > found[u]:
                continue
            for e in edges_of[u]:
                length = so_far + lengths[e]
                if length < found[ends[e]]:
                    found[ends[e]] = length
                    heapq.heappush(queue, (length, ends[e]))
        return found

    def signed_distances(self, weights: np.ndarray) -> np.ndarray | None:
        """Return the least sums to the target along any walk; None where a circle is negative."""
        lengths, tails = weights.tolist(), self.tails.tolist()
        found = [np.inf] * self.size
        found[self.target] = 0.0
        queue = [(0.0, self.target)]
        # Where weights are hardly negative most are final when they come first.
        for _ in range(_FEW * self.size):
            if not queue:
                return np.array(found)
            so_far, v = heapq.heappop(queue)
            if so_far > found[v]:
                continue
            for e in self.entering[v]:
                length = so_far + lengths[e]
                if length < found[tails[e]]:
                    found[tails[e]] = length
                    heapq.heappush(queue, (length, tails[e]))
        distances = np.full(self.size, np.inf)
        distances[self.target] = 0.0
        for _ in range(self.size + 1):
            before = distances.copy()
            np.minimum.at(distances, self.tails, weights + before[self.heads])
            if np.array_equal(distances, before):
                return distances
        return None

    def strong_components(self) -> np.ndarray:
        """Return a number for each vertex: the same for those that reach each other."""
        return strong_components(self.size, self.tails, self.heads)
