"""Lower bounds of paths, computed from multipliers by weak duality: no solver's word counts.

Each vertex v has a potential, an affine function h_v of its point. Where every edge costs at
least ``h_u(x_u) - h_v(x_v) + m_e``, a path costs at least ``h_s(x_s) - h_t(x_t)`` and the sum of
its ``m_e``; so the shortest way along these weights bounds every path. The weights are bounded in
turn: each convex cost by one of its affine minorants, and what is then affine by the supports of
the two sets. Rounding is counted against the bound throughout. The potentials are the dual
variables of the relaxation (Marcucci et al., see `relaxation`); a price for visiting a vertex is
that of the constraint that it is visited once.

A cycle of two edges, from a neighbour and back to it, has a price q, an affine function that is at
least 0 on its vertex's set. A path that leaves the vertex on another edge pays ``q(x)`` less than
it costs, and one that came by this edge gets it back: a simple path never gains by it, as it goes
on by another edge where it came by this one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from scene_graph_ros.geometry.optimization.graphs.edge_terms import Minorant, Multipliers
from scene_graph_ros.geometry.optimization.graphs.network import Network
from scene_graph_ros.geometry.optimization.graphs.relaxation import CyclePrice, Problem
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = ["Potentials", "ProvenBound", "bound_of_paths", "bound_of_points"]


@dataclass(frozen=True, eq=False)
class Potentials:
    """What a bound is computed from; any numbers give a bound, good ones a good one.

    ``levels (n,)`` and ``slopes``, ``(k,)`` each, of the vertices; ``visits (n,)`` prices, at
    least 0, of having left a vertex; ``prizes`` of the forced edges; multipliers of each edge;
    prices of some cycles of two edges.
    """

    levels: np.ndarray
    slopes: Sequence[np.ndarray]
    visits: np.ndarray
    prizes: np.ndarray
    multipliers: Sequence[Multipliers]
    cycles: Sequence[CyclePrice] = ()


@dataclass(frozen=True, eq=False)
class ProvenBound:
    """``value`` bounds every simple path from below; ``weights (m,)`` and ``left (n,)`` say more.

    A path costs at least the potentials' drop from source to target and the sum of its weights,
    less the visits of the vertices that it leaves and all prizes; ``left`` is the least sum of
    weights from a vertex to the target.
    """

    value: float
    weights: np.ndarray
    left: np.ndarray
    visits: np.ndarray
    potentials: Potentials


def bound_of_paths(problem: Problem, given: Potentials, with_cost: bool = True) -> ProvenBound:
    """Return a lower bound of all simple paths that take the forced edges.

    Without cost, a bound above 0 shows that there are none, as constraints can't be kept.
    """
    network = problem.network
    weights = _weights(problem, given, with_cost)
    visits = np.maximum(given.visits, 0.0)
    visits[network.target] = 0.0
    weights = weights + visits[network.tails]
    weights[list(problem.forced)] += given.prizes
    # A sum of as many weights as there are vertices is rounded by no more than this.
    rounding = (network.size + 4) * EPSILON
    weights -= rounding * np.abs(weights)
    left = network.signed_distances(weights)
    if left is None:
        # A circle that costs less than nothing is no part of a simple path: pay at its vertices.
        short = np.zeros(network.size)
        np.maximum.at(short, network.tails, -weights)
        visits = visits + short
        weights = weights + short[network.tails]
        weights = np.maximum(weights - rounding * np.abs(weights), 0.0)
        left = np.array(network.distances(weights, to_target=True))
    s, t = network.source, network.target
    ends = [given.levels[s], -given.levels[t], -given.prizes.sum()]
    for v, sign in ((s, -1.0), (t, 1.0)):
        ends += [-float(each[0]) for each in problem.sets[v].reach(sign * given.slopes[v][None])]
    parts = np.append(ends, [-visits.sum(), left[s]])
    if not np.isfinite(left[s]):
        return ProvenBound(np.inf, weights, left, visits, given)
    size = float(np.abs(parts).sum()) + float(np.abs(given.prizes).sum())
    value = float(parts.sum()) - 2.0 * (network.size + 8) * EPSILON * size
    return ProvenBound(value, weights, left, visits, given)


def _weights(problem: Problem, given: Potentials, with_cost: bool) -> np.ndarray:
    """Return for each edge a bound ``(m,)`` of its cost less the drop of potential."""
    network, slopes = problem.network, given.slopes
    minorants = [
        terms.minorant(m, with_cost)
        for terms, m in zip(problem.terms, given.multipliers, strict=True)
    ]
    weights = np.array([m.a - m.rounding for m in minorants]) + _off(network, given)
    priced = _Priced(problem, given.cycles)
    weights += priced.levels
    for v, placed in enumerate(problem.sets):
        out, into = network.leaving[v], network.entering[v]
        if not out and not into:
            continue
        r = slopes[v]
        D = [r - minorants[e].alpha - priced.at_tails.get(e, 0.0) for e in out]
        D += [-r - minorants[e].beta - priced.at_heads.get(e, 0.0) for e in into]
        off = [minorants[e].rounding_alpha + priced.off_at_tails.get(e, 0.0) for e in out]
        off += [minorants[e].rounding_beta + priced.off_at_heads.get(e, 0.0) for e in into]
        reach, rounding = placed.reach(np.array(D))
        lost = (np.array(off) + 2.0 * EPSILON * np.abs(r)) @ placed.half
        np.subtract.at(weights, np.array(out + into), reach + rounding + lost)
    return weights - 8.0 * EPSILON * np.abs(weights)


class _Priced:
    """What prices of cycles of two edges add to edges: levels ``(m,)``, slopes at both ends.

    ``levels`` are less what they are rounded by, ``off_at_tails`` and ``off_at_heads`` ``(n,)`` is
    what slopes may be.
    """

    def __init__(self, problem: Problem, prices: Sequence[CyclePrice]) -> None:
        self.levels = np.zeros(len(problem.network.tails))
        self._sizes = np.zeros(len(problem.network.tails))
        self.at_tails: dict[int, np.ndarray] = {}
        self.at_heads: dict[int, np.ndarray] = {}
        self.off_at_tails: dict[int, np.ndarray] = {}
        self.off_at_heads: dict[int, np.ndarray] = {}
        for price in prices:
            v, slope = price.of.vertex, price.slope
            reach, rounding = problem.sets[v].reach(-slope[None])
            # High enough to be at least 0 on all of the set.
            least = float(reach[0] + rounding[0]) * (1.0 + 4.0 * EPSILON)
            level = max(price.level, least)
            for e in problem.network.leaving[v]:
                if e not in price.of.back:
                    self._add(e, -level, -slope, self.at_tails, self.off_at_tails)
            for e in price.of.into:
                self._add(e, level, slope, self.at_heads, self.off_at_heads)
        self.levels -= 4.0 * (len(prices) + 2) * EPSILON * self._sizes
        rounding_of_sum = 4.0 * (len(prices) + 2) * EPSILON
        for off in (self.off_at_tails, self.off_at_heads):
            for e in off:
                off[e] = rounding_of_sum * off[e]

    def _add(
        self,
        e: int,
        level: float,
        slope: np.ndarray,
        slopes: dict[int, np.ndarray],
        sizes: dict[int, np.ndarray],
    ) -> None:
        self.levels[e] += level
        self._sizes[e] += abs(level)
        slopes[e] = slopes.get(e, 0.0) + slope
        sizes[e] = sizes.get(e, 0.0) + np.abs(slope)


def _off(network: Network, given: Potentials) -> np.ndarray:
    """Return the drop of the levels along each edge ``(m,)``, less what its rounding may add."""
    tails, heads = network.tails, network.heads
    p, q = given.levels[tails], given.levels[heads]
    return q - p - 4.0 * EPSILON * (np.abs(p) + np.abs(q))


def bound_of_points(
    problem: Problem,
    path: Sequence[int],
    multipliers: Sequence[Multipliers],
    end: tuple[float, np.ndarray] | None = None,
    with_cost: bool = True,
) -> float:
    """Return a lower bound of the cost of a path over all points of its sets.

    ``end`` is a potential at the last vertex, level and slope ``(n,)``, which is added. Without
    cost, a bound above 0 shows that the path's constraints can't be kept.
    """
    network = problem.network
    minorants = [
        problem.terms[e].minorant(m, with_cost) for e, m in zip(path, multipliers, strict=True)
    ]
    vertices = [network.source, *(int(network.heads[e]) for e in path)]
    total = sum(m.a for m in minorants)
    lost = sum(m.rounding for m in minorants)
    size = sum(abs(m.a) for m in minorants)
    if end is not None:
        total, size = total + end[0], size + abs(end[0])
    for k, v in enumerate(vertices):
        placed = problem.sets[v]
        D, off = _slope_at(k, minorants, len(placed.half))
        if end is not None and k == len(path):
            D, off = D + end[1], off + 2.0 * EPSILON * (np.abs(D) + np.abs(end[1]))
        reach, rounding = placed.reach(-D[None])
        total -= float(reach[0])
        lost += float(rounding[0]) + float(off @ placed.half)
        size += abs(float(reach[0]))
    return float(total) - lost - 2.0 * (2 * len(path) + 8) * EPSILON * size


def _slope_at(k: int, minorants: Sequence[Minorant], n: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the slope ``(n,)`` of the path's cost at its k-th vertex, and its rounding."""
    slope, off = np.zeros(n), np.zeros(n)
    if k > 0:
        slope, off = slope + minorants[k - 1].beta, off + minorants[k - 1].rounding_beta
    if k < len(minorants):
        slope, off = slope + minorants[k].alpha, off + minorants[k].rounding_alpha
    return slope, off + 2.0 * EPSILON * np.abs(slope)
