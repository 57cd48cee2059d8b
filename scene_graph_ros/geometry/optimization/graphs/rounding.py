"""Paths drawn from flows: a random walk that goes back where it gets stuck."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from scene_graph_ros.geometry.optimization.graphs.network import Network

__all__ = ["draw_paths", "main_path"]


def main_path(network: Network, flows: np.ndarray, tolerance: float) -> tuple[int, ...] | None:
    """Return the simple path that follows the most flow at each vertex, None where there is none.

    Edges with no more flow than ``tolerance`` don't count.
    """
    return _walk(network, flows, tolerance, None)


def draw_paths(
    network: Network,
    flows: np.ndarray,
    most: int,
    trials: int,
    tolerance: float,
    generator: np.random.Generator,
) -> list[tuple[int, ...]]:
    """Return different simple paths, at most ``most``, of at most ``trials`` walks.

    The next edge is drawn with the probability of its flow among those to vertices that were not
    visited; edges with no more flow than ``tolerance`` don't count (Marcucci, Petersen, von
    Wrangel and Tedrake, "Motion planning around obstacles with convex optimization", 2023, section
    4.2).
    """
    found: list[tuple[int, ...]] = []
    for _ in range(trials):
        path = _walk(network, flows, tolerance, generator) if len(found) < most else None
        if path is None:
            break
        if path not in found:
            found.append(path)
        if len(found) == 1 and _is_only_one(network, flows, tolerance, path):
            break
    return found


def _is_only_one(
    network: Network, flows: np.ndarray, tolerance: float, path: Sequence[int]
) -> bool:
    """Tell whether a path never has another edge to go along, so that each walk is this one."""
    return all(
        sum(flows[e] > tolerance for e in network.leaving[int(network.tails[taken])]) == 1
        for taken in path
    )


def _walk(
    network: Network,
    flows: np.ndarray,
    tolerance: float,
    generator: np.random.Generator | None,
) -> tuple[int, ...] | None:
    """Return one path, None where there is none along the flows.

    Without a generator always along the most flow.
    """
    heads = network.heads.tolist()
    path: list[int] = []
    seen = {network.source}
    at = network.source
    while at != network.target:
        edges = [e for e in network.leaving[at] if flows[e] > tolerance and heads[e] not in seen]
        if edges:
            shares = flows[edges]
            e = edges[int(np.argmax(shares)) if generator is None else _draw(shares, generator)]
            path.append(e)
            at = heads[e]
            seen.add(at)
        elif path:
            # What was tried stays seen: it leads nowhere from here.
            at = int(network.tails[path.pop()])
        else:
            return None
    return tuple(path)


def _draw(flows: Sequence[float] | np.ndarray, generator: np.random.Generator) -> int:
    shares = np.cumsum(flows)
    return min(
        int(np.searchsorted(shares, generator.random() * shares[-1], side="right")),
        len(shares) - 1,
    )
