"""A graph's edges as numbers: what can be on a simple path, and shortest ways along weights."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
import heapq
import itertools

import numpy as np

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
    leaving: list[list[int]] = field(init=False)
    """The edges out of each vertex."""
    entering: list[list[int]] = field(init=False)

    def __post_init__(self) -> None:
        """List the edges at each vertex."""
        object.__setattr__(self, "origin", self.origin or range(self.size))
        leaving: list[list[int]] = [[] for _ in range(self.size)]
        entering: list[list[int]] = [[] for _ in range(self.size)]
        for e, (u, v) in enumerate(zip(self.tails.tolist(), self.heads.tolist(), strict=True)):
            leaving[u].append(e)
            entering[v].append(e)
        object.__setattr__(self, "leaving", leaving)
        object.__setattr__(self, "entering", entering)

    def on_simple_paths(self) -> np.ndarray:
        """Return edges ``(k,)`` without those that are seen to be on no simple path.

        An edge is on none where its tail is not reached, its head does not reach the target, every
        way to the tail leads through the head, or every way on from the head through the tail
        (Lengauer and Tarjan, "A fast algorithm for finding dominators in a flowgraph", 1979, say
        what dominators are; found as in Cooper, Harvey and Kennedy, "A simple, fast dominance
        algorithm", 2001). And where it is on no simple path even if edges may be taken either
        way, which the blocks of the graph tell (Hopcroft and Tarjan, "Algorithm 447", 1973). Time
        is nearly linear; some such edges may stay.
        """
        # The fastest first: few edges are left for what takes the longest.
        some = np.array(self._in_the_block(self._without_dead_ends().tolist()), dtype=np.int64)
        ends = self.tails[some], self.heads[some]
        return some[Network(self.size, *ends, self.source, self.target)._on_simple_paths()]

    def _without_dead_ends(self) -> np.ndarray:
        """Return edges ``(k,)`` without those of vertices with one neighbour, again and again.

        Most of a maze are such, and numbers tell them faster than walks.
        """
        low, high = np.minimum(self.tails, self.heads), np.maximum(self.tails, self.heads)
        keys, pair = np.unique(low * self.size + high, return_inverse=True)
        first, second = keys // self.size, keys % self.size
        is_left = np.ones(len(keys), dtype=bool)
        while True:
            ends = np.concatenate([first[is_left], second[is_left]])
            is_dead = np.bincount(ends, minlength=self.size) == 1
            is_dead[[self.source, self.target]] = False
            dead = is_left & (is_dead[first] | is_dead[second])
            if not dead.any():
                return np.flatnonzero(is_left[pair])
            is_left &= ~dead

    def _on_simple_paths(self) -> np.ndarray:
        tails, heads = self.tails.tolist(), self.heads.tolist()
        ahead = _Dominators(self.source, self.leaving, heads, self.entering, tails)
        back = _Dominators(self.target, self.entering, tails, self.leaving, heads)
        kept = [
            e
            for e, (u, v) in enumerate(zip(tails, heads, strict=True))
            if v != self.source
            and u != self.target
            and ahead.is_reached(u)
            and back.is_reached(v)
            and not ahead.dominates(v, u)
            and not back.dominates(u, v)
        ]
        rest = self._in_the_block(kept)
        return np.array(rest, dtype=np.int64)

    def _in_the_block(self, edges: Sequence[int]) -> list[int]:
        """Return those of some edges that are in one block with an edge from source to target.

        A block is what no single vertex cuts; these are the edges of simple paths of an undirected
        graph.
        """
        tails, heads = self.tails.tolist(), self.heads.tolist()
        ways: list[list[tuple[int, int]]] = [[] for _ in range(self.size)]
        for e in edges:
            ways[tails[e]].append((e, heads[e]))
            ways[heads[e]].append((e, tails[e]))
        # Depth first from the target, to which the first edge leads from the source.
        depth, low = {self.source: 0, self.target: 1}, {self.source: 0, self.target: 0}
        stack = [(self.target, -1, iter(ways[self.target]))]
        passed: list[int] = []
        block: set[int] = set()
        while stack:
            v, came_by, rest = stack[-1]
            for e, w in rest:
                if e == came_by:
                    continue
                if w not in depth:
                    passed.append(e)
                    depth[w] = low[w] = len(stack) + 1
                    stack.append((w, e, iter(ways[w])))
                    break
                if depth[w] < depth[v]:
                    passed.append(e)
                    low[v] = min(low[v], depth[w])
            else:
                stack.pop()
                if not stack:
                    block.update(passed)
                    break
                u = stack[-1][0]
                low[u] = min(low[u], low[v])
                if low[v] >= depth[u]:
                    # What is beyond u is a block of its own.
                    while passed.pop() != came_by:
                        pass
        return [e for e in edges if e in block]

    def two_cycles(self) -> list[TwoCycle]:
        """Return those at each vertex but source and target."""
        found = []
        for v in range(self.size):
            if v in (self.source, self.target):
                continue
            into: dict[int, list[int]] = {}
            for e in self.entering[v]:
                into.setdefault(self.origin[self.tails[e]], []).append(e)
            back: dict[int, list[int]] = {}
            for e in self.leaving[v]:
                back.setdefault(self.origin[self.heads[e]], []).append(e)
            found += [
                TwoCycle(v, tuple(edges), tuple(back[u])) for u, edges in into.items() if u in back
            ]
        return found

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
        from scipy import sparse
        from scipy.sparse.csgraph import connected_components

        size = (self.size, self.size)
        edges = sparse.csr_array((np.ones(len(self.tails)), (self.tails, self.heads)), size)
        return connected_components(edges, connection="strong")[1]


class _Dominators:
    """The tree of immediate dominators of what is reached from a root."""

    def __init__(
        self,
        root: int,
        leaving: Sequence[Iterable[int]],
        heads: Sequence[int],
        entering: Sequence[Iterable[int]],
        tails: Sequence[int],
    ) -> None:
        order = _postorder(root, leaving, heads)
        rank = {v: k for k, v in enumerate(order)}
        # All by ranks, of which the root has the last.
        before = [[rank[u] for e in entering[v] if (u := tails[e]) in rank] for v in order]
        above = [-1] * len(order)
        above[-1] = len(order) - 1
        changed = True
        while changed:
            changed = False
            for v in range(len(order) - 2, -1, -1):
                new = -1
                for u in before[v]:
                    if above[u] >= 0:
                        new = u if new < 0 else _meet(new, u, above)
                if above[v] != new:
                    above[v] = new
                    changed = True
        parents = {v: order[u] for v, u in zip(order, above, strict=True)}
        self._first, self._last = _intervals(root, parents)

    def is_reached(self, v: int) -> bool:
        return v in self._first

    def dominates(self, v: int, u: int) -> bool:
        """Tell whether all ways from the root to u lead through v."""
        return v in self._first and self._first[v] <= self._first[u] <= self._last[v]


def _meet(a: int, b: int, above: Sequence[int]) -> int:
    while a != b:
        if a < b:
            a = above[a]
        else:
            b = above[b]
    return a


def _postorder(root: int, leaving: Sequence[Iterable[int]], heads: Sequence[int]) -> list[int]:
    """Return what is reached, in the order in which a walk leaves it for good."""
    order = []
    seen = {root}
    stack = [(root, iter(leaving[root]))]
    while stack:
        v, edges = stack[-1]
        for e in edges:
            if heads[e] not in seen:
                seen.add(heads[e])
                stack.append((heads[e], iter(leaving[heads[e]])))
                break
        else:
            order.append(v)
            stack.pop()
    return order


def _intervals(root: int, above: dict[int, int]) -> tuple[dict[int, int], dict[int, int]]:
    """Return when a walk of the tree enters each vertex, and the last that it enters below."""
    below: dict[int, list[int]] = {}
    for v, parent in above.items():
        if v != root:
            below.setdefault(parent, []).append(v)
    first, last, count = {}, {}, itertools.count()
    stack = [(root, False)]
    current = 0
    while stack:
        v, is_done = stack.pop()
        if is_done:
            last[v] = current
            continue
        current = next(count)
        first[v] = current
        stack.append((v, True))
        stack.extend((w, False) for w in below.get(v, ()))
    return first, last
