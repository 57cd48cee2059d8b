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
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from scene_graph_ros.geometry.optimization.graphs.edge_table import (
    EdgeTable,
    Minorants,
    Multipliers,
)
from scene_graph_ros.geometry.optimization.graphs.network import Network
from scene_graph_ros.geometry.optimization.graphs.placed_set import PlacedSet, reach_of
from scene_graph_ros.geometry.optimization.graphs.relaxation import CyclePrice, Problem, Relaxed
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = [
    "Potentials",
    "ProvenBound",
    "bound_of_paths",
    "bound_of_points",
    "bound_of_relaxation",
]


@dataclass(frozen=True, eq=False)
class Potentials:
    """What a bound is computed from; any numbers give a bound, good ones a good one.

    ``levels (n,)`` and ``slopes``, ``(k,)`` each, of the vertices; ``visits (n,)`` prices, at
    least 0, of having left a vertex; ``prizes`` of the forced edges; multipliers of each family of
    edges; prices of some cycles of two edges.
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
    below = problem.terms.minorants(given.multipliers, with_cost)
    return _bound(problem, given, _without_levels(problem, given, below))


def _bound(problem: Problem, given: Potentials, others: np.ndarray) -> ProvenBound:
    """Return the bound of all simple paths; ``others (m,)`` are weights but for the levels."""
    network = problem.network
    weights = _weights(network, given, others)
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


def bound_of_relaxation(problem: Problem, relaxed: Relaxed) -> ProvenBound:
    """Return the bound of all paths that the relaxation's multipliers say, its levels balanced.

    Without cost, where the relaxation says that no path is possible: above 0 this is proven.
    """
    below = problem.terms.minorants(relaxed.multipliers, relaxed.cost < np.inf)
    given = Potentials(
        relaxed.levels,
        _passed_on(problem, relaxed.slopes, below),
        relaxed.visits,
        relaxed.prizes,
        relaxed.multipliers,
        relaxed.cycles,
    )
    others = _without_levels(problem, given, below)
    return _bound(problem, _balanced(problem.network, given, others), others)


def _passed_on(
    problem: Problem, slopes: Sequence[np.ndarray], below: Sequence[Minorants]
) -> list[np.ndarray]:
    """Give vertices whose edges share all they have the slopes of what is paid from there.

    Their rows are not in the relaxation, so that it says nothing of them. What their sets reach
    is then counted once, at the edge that leads there; their levels are free.
    """
    found, before, tails = list(slopes), problem.network.ways_on, problem.network.tails.tolist()
    for family, each in zip(problem.terms.families, below, strict=True):
        for e, slope in zip(family.edges.tolist(), each.alpha, strict=True):
            if e in before:
                found[tails[e]] = slope
    return found


def _balanced(network: Network, given: Potentials, others: np.ndarray) -> Potentials:
    """Return potentials whose levels leave nothing to edges that all paths come to by one other.

    Levels where these meet are free; so weights that add up to something are not below 0 in turn.
    """
    before = network.ways_on
    if not before:
        return given
    weights, levels = _weights(network, given, others).tolist(), given.levels.tolist()
    tails = network.tails.tolist()
    for e in reversed(before):
        levels[tails[e]] += weights[e]
        weights[before[e]] += weights[e]
    return replace(given, levels=np.array(levels))


def _weights(network: Network, given: Potentials, others: np.ndarray) -> np.ndarray:
    """Return for each edge a bound ``(m,)`` of its cost less the drop of potential."""
    tails, heads = network.tails, network.heads
    p, q = given.levels[tails], given.levels[heads]
    weights = others + (q - p - 4.0 * EPSILON * (np.abs(p) + np.abs(q)))
    return weights - 16.0 * EPSILON * np.abs(weights)


def _without_levels(
    problem: Problem, given: Potentials, below: Sequence[Minorants]
) -> np.ndarray:
    """Return the same ``(m,)`` where all levels are 0, if costs are at least their minorants.

    What the rounding of levels takes is not counted.
    """
    network, slopes = problem.network, given.slopes
    tails, heads = network.tails.tolist(), network.heads.tolist()
    priced = _Priced(problem, given.cycles)
    weights = priced.levels.copy()
    for family, each in zip(problem.terms.families, below, strict=True):
        edges = family.edges.tolist()
        weights[family.edges] += each.a - each.rounding
        for ends, sets, half, sign, slope, off, prices in (
            (tails, family.tails, family.half_u, 1.0, each.alpha, each.rounding_alpha, priced.u),
            (heads, family.heads, family.half_v, -1.0, each.beta, each.rounding_beta, priced.v),
        ):
            r = sign * np.array([slopes[ends[e]] for e in edges])
            D, off = r - slope, off + 2.0 * EPSILON * np.abs(r)
            for k, e in enumerate(edges if prices.slopes else ()):
                if e in prices.slopes:
                    D[k] -= prices.slopes[e]
                    off[k] += prices.off[e]
            reach, rounding = reach_of(sets, D, half)
            weights[family.edges] -= reach + rounding + np.sum(off * half, axis=1)
    return weights


class _Slopes(NamedTuple):
    """Slopes ``(n,)`` by edges, and what they are rounded by."""

    slopes: dict[int, np.ndarray]
    off: dict[int, np.ndarray]


class _Priced:
    """What prices of cycles of two edges add to edges: levels ``(m,)``, slopes at both ends.

    ``levels`` are less what they are rounded by.
    """

    def __init__(self, problem: Problem, prices: Sequence[CyclePrice]) -> None:
        self.levels = np.zeros(len(problem.network.tails))
        self._sizes = np.zeros(len(problem.network.tails))
        self.u, self.v = _Slopes({}, {}), _Slopes({}, {})
        for price in prices:
            v, slope = price.of.vertex, price.slope
            reach, rounding = problem.sets[v].reach(-slope[None])
            # High enough to be at least 0 on all of the set.
            least = float(reach[0] + rounding[0]) * (1.0 + 4.0 * EPSILON)
            level = max(price.level, least)
            for e in problem.network.leaving[v]:
                if e not in price.of.back:
                    self._add(e, -level, -slope, self.u)
            for e in price.of.into:
                self._add(e, level, slope, self.v)
        self.levels -= 4.0 * (len(prices) + 2) * EPSILON * self._sizes
        rounding_of_sum = 4.0 * (len(prices) + 2) * EPSILON
        for each in (self.u, self.v):
            for e in each.off:
                each.off[e] = rounding_of_sum * each.off[e]

    def _add(self, e: int, level: float, slope: np.ndarray, at: _Slopes) -> None:
        self.levels[e] += level
        self._sizes[e] += abs(level)
        at.slopes[e] = at.slopes.get(e, 0.0) + slope
        at.off[e] = at.off.get(e, 0.0) + np.abs(slope)


def bound_of_points(
    taken: EdgeTable,
    sets: Sequence[PlacedSet],
    multipliers: Sequence[Multipliers],
    end: tuple[float, np.ndarray] | None = None,
    with_cost: bool = True,
) -> float:
    """Return a lower bound of the cost of a path's edges over all points of its sets.

    ``end`` is a potential at the last vertex, level and slope ``(n,)``, which is added. Without
    cost, a bound above 0 shows that the path's constraints can't be kept.
    """
    count = len(taken)
    D = [np.zeros(len(placed.half)) for placed in sets]
    off = [np.zeros(len(placed.half)) for placed in sets]
    total, lost, size = 0.0, 0.0, 0.0
    for family, each in zip(taken.families, taken.minorants(multipliers, with_cost), strict=True):
        total, lost = total + float(each.a.sum()), lost + float(each.rounding.sum())
        size += float(np.abs(each.a).sum())
        for k, alpha, beta, off_alpha, off_beta in zip(
            family.edges.tolist(),
            each.alpha,
            each.beta,
            each.rounding_alpha,
            each.rounding_beta,
            strict=True,
        ):
            D[k], off[k] = D[k] + alpha, off[k] + off_alpha
            D[k + 1], off[k + 1] = D[k + 1] + beta, off[k + 1] + off_beta
    if end is not None:
        total, size = total + end[0], size + abs(end[0])
        D[count], off[count] = D[count] + end[1], off[count] + 2.0 * EPSILON * np.abs(end[1])
    alike: dict[int, list[int]] = {}
    for k, slope in enumerate(D):
        alike.setdefault(len(slope), []).append(k)
    for some in alike.values():
        slopes, half = np.array([D[k] for k in some]), np.array([sets[k].half for k in some])
        # Each slope is a sum of three at most.
        rounded = np.array([off[k] for k in some]) + 4.0 * EPSILON * np.abs(slopes)
        reach, rounding = reach_of([sets[k] for k in some], -slopes, half)
        total -= float(reach.sum())
        lost += float(rounding.sum()) + float(np.sum(rounded * half))
        size += float(np.abs(reach).sum())
    return float(total) - lost - 2.0 * (2 * count + 8) * EPSILON * size
