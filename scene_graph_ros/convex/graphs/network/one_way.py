"""Vertices that a path passes one way or the other, as two: flows can't turn around in them."""

from __future__ import annotations

from scene_graph_ros.convex.graphs.network.network import Network

__all__ = ["split_by_direction"]


def split_by_direction(network: Network) -> Network:
    """Return a network with the same edges, whose vertices' origins are those of the given one.

    A vertex with edges from and to two neighbours is two of them: a simple path comes from one and
    goes on to the other, and no simple path gets to both, as it would visit a neighbour twice.
    Simple paths are the same, walks are fewer, so that the relaxation is tighter.
    """
    tails, heads = network.tails.copy(), network.heads.copy()
    origin = list(range(network.size))
    from_, to = network.tails.tolist(), network.heads.tolist()
    for v in range(network.size):
        if v in (network.source, network.target):
            continue
        before = {from_[e] for e in network.entering[v]}
        if len(before) != 2 or before != {to[e] for e in network.leaving[v]}:
            continue
        first, second = sorted(before)
        for e in network.entering[v]:
            if from_[e] == second:
                heads[e] = len(origin)
        for e in network.leaving[v]:
            if to[e] == first:
                tails[e] = len(origin)
        origin.append(v)
    return Network(len(origin), tails, heads, network.source, network.target, origin)
