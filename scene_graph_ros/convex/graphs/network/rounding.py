"""Paths drawn from flows: a random walk that goes back where it gets stuck."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator, Sequence
from itertools import accumulate
from typing import NamedTuple

import numpy as np

from scene_graph_ros.convex.graphs.network.network import Network

__all__ = ["draw_paths", "main_path"]


def main_path(network: Network, flows: np.ndarray, tolerance: float) -> tuple[int, ...] | None:
    """Return the simple path that follows the most flow at each vertex, None where there is none.

    Edges with no more flow than ``tolerance`` don't count.
    """
    return _walk(_Flows.of(network, flows, tolerance), None)


def draw_paths(
    network: Network,
    flows: np.ndarray,
    most: int,
    trials: int,
    tolerance: float,
    generator: np.random.Generator,
) -> Iterator[tuple[int, ...]]:
    """Draw different simple paths, at most ``most``, of at most ``trials`` walks.

    The next edge is drawn with the probability of its flow among those to vertices that were not
    visited; edges with no more flow than ``tolerance`` don't count (Marcucci, Petersen, von
    Wrangel and Tedrake, "Motion planning around obstacles with convex optimization", 2023, section
    4.2).
    """
    found: list[tuple[int, ...]] = []
    taken = _Flows.of(network, flows, tolerance)
    for _ in range(trials):
        path = _walk(taken, generator) if len(found) < most else None
        if path is None:
            break
        if path not in found:
            found.append(path)
            yield path
        if len(found) == 1 and all(len(taken.leaving[taken.tails[e]]) == 1 for e in path):
            break  # there is never another edge to go along, so that each walk is this one


class _Flows(NamedTuple):
    """The edges with flow, as walks read them."""

    source: int
    target: int
    heads: list[int]
    tails: list[int]
    flows: list[float]
    leaving: list[list[int]]
    """Those from each vertex, with flow."""
    runs: dict[int, tuple[list[int], list[int]]]
    """From vertices where walks came, those that follow each other without a choice; and the
    vertices that they lead to."""

    @classmethod
    def of(cls, network: Network, flows: np.ndarray, tolerance: float) -> _Flows:
        """Return those with more flow than a tolerance."""
        values = flows.tolist()
        leaving = [[e for e in edges if values[e] > tolerance] for edges in network.leaving]
        heads, tails = network.heads.tolist(), network.tails.tolist()
        return cls(network.source, network.target, heads, tails, values, leaving, {})

    def run(self, start: int) -> tuple[list[int], list[int]]:
        """Return the edges from a vertex on while there is one each, and where they lead to."""
        if start not in self.runs:
            edges: list[int] = []
            vertices: dict[int, None] = {}
            at = start
            while len(self.leaving[at]) == 1 and at != self.target:
                e = self.leaving[at][0]
                if self.heads[e] == start or self.heads[e] in vertices:
                    break
                edges.append(e)
                at = self.heads[e]
                vertices[at] = None
            self.runs[start] = edges, list(vertices)
        return self.runs[start]


def _walk(taken: _Flows, generator: np.random.Generator | None) -> tuple[int, ...] | None:
    """Return one path, None where there is none along the flows.

    Without a generator always along the most flow.
    """
    path: list[int] = []
    seen, at = {taken.source}, taken.source
    while at != taken.target:
        along, vertices = taken.run(at)
        if along and seen.isdisjoint(vertices):
            path += along
            seen.update(vertices)
            at = vertices[-1]
            continue
        edges = [e for e in taken.leaving[at] if taken.heads[e] not in seen]
        if edges:
            shares = [taken.flows[e] for e in edges]
            k = shares.index(max(shares)) if generator is None else _draw(shares, generator)
            path.append(edges[k])
            at = taken.heads[edges[k]]
            seen.add(at)
        elif path:
            # What was tried stays seen: it leads nowhere from here.
            at = taken.tails[path.pop()]
        else:
            return None
    return tuple(path)


def _draw(flows: Sequence[float], generator: np.random.Generator) -> int:
    shares = list(accumulate(flows))
    return min(bisect_right(shares, generator.random() * shares[-1]), len(shares) - 1)
