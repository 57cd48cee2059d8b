"""Lower bounds of paths, computed from multipliers by weak duality: no solver's word counts.

Each vertex v has a potential, an affine function h_v of its point. Where every edge costs at
least ``h_u(x_u) - h_v(x_v) + m_e``, a path costs at least ``h_s(x_s) - h_t(x_t)`` and the sum of
its ``m_e``; so the shortest way along these weights bounds every path. The weights are bounded in
turn: each convex cost by one of its affine minorants, and the affine remainder by the supports of
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

import numpy as np

from scene_graph_ros.convex.graphs.model.placed_set import PlacedSet
from scene_graph_ros.convex.graphs.model.set_kernels import least_over_sets
from scene_graph_ros.convex.graphs.network.network import Network
from scene_graph_ros.convex.graphs.relax.edge_table import EdgeTable, Minorants
from scene_graph_ros.convex.graphs.relax.relaxation import CyclePrice, Problem, Relaxed
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
    """The inputs of a bound; any numbers give a bound, good ones a good one.

    ``levels (n,)`` and ``slopes``, ``(k,)`` each, of the vertices; ``visits (n,)`` prices, at
    least 0, of having left a vertex; ``prizes`` of the forced edges; ``weights (r,)`` of all
    edges' rows, edge after edge; prices of some cycles of two edges.
    """

    levels: np.ndarray
    slopes: Sequence[np.ndarray]
    visits: np.ndarray
    prizes: np.ndarray
    weights: np.ndarray
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
    below = problem.terms.minorants(given.weights, with_cost)
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
    below = problem.terms.minorants(relaxed.weights, relaxed.cost < np.inf)
    given = Potentials(
        relaxed.levels,
        _passed_on(problem, relaxed.slopes, below),
        relaxed.visits,
        relaxed.prizes,
        relaxed.weights,
        relaxed.cycles,
    )
    others = _without_levels(problem, given, below)
    return _bound(problem, _balanced(problem.network, given, others), others)


def _passed_on(
    problem: Problem, slopes: Sequence[np.ndarray], below: Minorants
) -> list[np.ndarray]:
    """Give vertices whose edges share all they have the slopes of the cost from there.

    Their rows are not in the relaxation, so that it says nothing of them. Their sets' support
    is then counted once, at the edge that leads there; their levels are free.
    """
    found, firsts, tails = list(slopes), below.firsts.tolist(), problem.network.tails.tolist()
    for e in problem.network.ways_on:
        found[tails[e]] = below.slopes[slice(*firsts[e])]
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


def _without_levels(problem: Problem, given: Potentials, below: Minorants) -> np.ndarray:
    """Return the same ``(m,)`` where all levels are 0, if costs are at least their minorants.

    The rounding of levels is not counted.
    """
    network = problem.network
    ends = np.column_stack([network.tails, network.heads])
    D, off, totals = below.slopes.copy(), below.rounding.copy(), below.totals.copy()
    _add_prices(problem, given.cycles, below.firsts, (D, off, totals))
    slopes = np.concatenate([np.zeros(0), *given.slopes])
    least_over_sets(*problem.packed_sets, ends, slopes, D, off, totals)
    others: dict[int, list[tuple[int, int]]] = {}
    if not all(placed.tells_reach for placed in problem.sets):
        for (e, end), v in np.ndenumerate(ends):
            if not problem.sets[v].tells_reach:
                others.setdefault(id(problem.sets[v]), []).append((e, end))
    for some in others.values():
        edges = [e for e, _ in some]
        placed = problem.sets[ends[some[0]]]
        at = np.array([below.firsts[each] for each in some])[:, None]
        reach, rounding = placed.reach(-D[at + np.arange(len(placed.center))])
        # An edge may lead from a set to the same one.
        np.add.at(totals, edges, np.column_stack([-reach, rounding, np.abs(reach)]))
    return totals[:, 0] - totals[:, 1] - 16.0 * EPSILON * totals[:, 2]


def _add_prices(
    problem: Problem,
    prices: Sequence[CyclePrice],
    firsts: np.ndarray,
    to: tuple[np.ndarray, np.ndarray, np.ndarray],
) -> None:
    """Add prices of cycles of two edges to slopes, their rounding and the totals."""
    if not prices:
        return
    D, off, totals = to
    sizes, rounding = np.zeros(len(totals)), 4.0 * (len(prices) + 2) * EPSILON
    for price in prices:
        v, slope = price.of.vertex, price.slope
        reach, rounded = problem.sets[v].reach(-slope[None])
        # High enough to be at least 0 on all of the set.
        least = float(reach[0] + rounded[0]) * (1.0 + 4.0 * EPSILON)
        level = max(price.level, least)
        away = [e for e in problem.network.leaving[v] if e not in price.of.back]
        for edges, end, sign in ((away, 0, 1.0), (price.of.into, 1, -1.0)):
            for e in edges:
                totals[e, 0] -= sign * level
                sizes[e] += abs(level)
                at = slice(firsts[e, end], firsts[e, end] + len(slope))
                D[at] -= sign * slope
                off[at] += rounding * np.abs(slope)
    totals[:, 1] += rounding * sizes


def bound_of_points(
    taken: EdgeTable,
    sets: Sequence[PlacedSet],
    weights: np.ndarray,
    end: tuple[float, np.ndarray] | None = None,
    with_cost: bool = True,
) -> float:
    """Return a lower bound of the cost of a path's edges over all points of its sets.

    From any weights ``(r,)`` of the edges' rows. ``end`` is a potential at the last vertex, level
    and slope ``(n,)``, which is added. Without cost, a bound above 0 shows that the path's
    constraints can't be kept.
    """
    below = taken.minorants(weights, with_cost)
    level, slope = (0.0, np.zeros(len(sets[-1].half))) if end is None else end
    totals = np.append(below.totals, [[level, 0.0, abs(level)]], axis=0)
    for k, placed in enumerate(sets):
        # What comes from the edge before, and from the one behind.
        n, D, off = len(placed.half), np.zeros(len(placed.half)), np.zeros(len(placed.half))
        before = [below.firsts[k - 1, 1]] if k else []
        behind = [below.firsts[k, 0]] if k < len(taken) else []
        for at in (*before, *behind):
            D, off = D + below.slopes[at : at + n], off + below.rounding[at : at + n]
        if k == len(taken):
            D, off = D + slope, off + 2.0 * EPSILON * np.abs(slope)
        reach, rounding = placed.reach(-D[None])
        # Each slope is a sum of three at most.
        lost = float(rounding[0]) + float((off + 4.0 * EPSILON * np.abs(D)) @ placed.half)
        totals[-1] += [-float(reach[0]), lost, abs(float(reach[0]))]
    total, lost, size = totals.sum(axis=0).tolist()
    return float(total - lost - 2.0 * (2 * len(taken) + 8) * EPSILON * size)
