"""The way out of a slight collision: to a configuration near by that is free."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.planning.checker.collision_checker import SceneGraphCollisionChecker
from scene_graph_ros.planning.checker.start_overlap import start_overlap_of
from scene_graph_ros.planning.pairs.checker_plan import CheckerPlan
from scene_graph_ros.planning.pairs.near_pairs import near_pairs_at

__all__ = ["LeadOut", "lead_out", "least_change"]

_APART = 1e-3
"""Metres: pairs that overlap are led so far apart; where that can't be, as far as they go."""

_ENOUGH = 0.5
"""Of that: what is reached where the last steps are small."""

_SEEN = 0.05
"""Metres: pairs that are farther apart than this are not looked at on a step."""

_LONGEST = 0.1
"""rad or m: what one position changes in a step at most."""

_MOST_STEPS = 50


class LeadOut(NamedTuple):
    """How a start that collides is left, or why it is not."""

    configurations: NDArray[np.float64]
    """``(k, nq)``: from the start to a configuration that is free; none where there is no way."""
    leaves_collision: bool
    """Whether the start collides."""
    words: str
    """Why there is no way, to follow a sentence; "" where there is one."""


def lead_out(
    checker: SceneGraphCollisionChecker,
    measured: NDArray[np.float64],
    start: NDArray[np.float64],
    moves: NDArray[np.bool_],
    most: float,
) -> LeadOut:
    """Return a way from where the robot was ``measured`` to a configuration near by that is free.

    Both are ``(nq,)``: ``start`` is the nearest within limits, ``moves`` is the mask of positions
    that may change. On the way no pair is nearer than its padding by more than at its beginning,
    and `DEEPER`: that is proven. Starts deeper than ``most`` (m) are left as they are.
    """
    begin = measured[np.newaxis]
    overlap = start_overlap_of(checker, measured) if most > 0.0 else None
    if overlap is None:
        both = np.stack([measured, start]) if (measured != start).any() else begin
        return LeadOut(both, leaves_collision=False, words="")
    if overlap.depth > most:
        words = f", and start_overlap allows {1e3 * most:.4g} mm"
        return LeadOut(begin[:0], leaves_collision=True, words=words)
    way = _way(checker, start, moves, overlap.rows)
    if way is not None:
        # Straight where that is proven, else by the steps that led there.
        for part in (way[-1:], way):
            path = np.concatenate([begin, part])
            edges = np.stack([path[:-1], path[1:]], axis=1)
            if overlap.checker.check_edges_collision_free(edges).all():
                return LeadOut(path, leaves_collision=True, words="")
    words = ", and no way was found that leads out of it"
    return LeadOut(begin[:0], leaves_collision=True, words=words)


def _way(
    checker: SceneGraphCollisionChecker,
    start: NDArray[np.float64],
    moves: NDArray[np.bool_],
    overlapping: NDArray[np.int64],
) -> NDArray[np.float64] | None:
    """Return configurations ``(k, nq)`` from a start to one that is free, None without one.

    Each step is the least change that, to first order, leads all pairs that overlap apart, and
    has none that is near use up more than half of its distance. ``overlapping`` ``(p,)`` are the
    pairs that do at the start.
    """
    plan, least = checker.plan, 4.0 * checker.tolerance
    steps, best = [start], None
    for _ in range(_MOST_STEPS):
        near = near_pairs_at(plan, steps[-1][np.newaxis], _SEEN)
        is_led = np.isin(near.rows, overlapping) | (near.distances < least)
        apart = float(near.distances.min(initial=np.inf))
        led = float(near.distances[is_led].min(initial=np.inf))
        if apart >= least:
            best = len(steps)
            if led >= _ENOUGH * _APART:
                break
        wanted = np.where(is_led, _APART - near.distances, 0.5 * (least - near.distances))
        change = _change(plan, steps[-1], near.jacobians, wanted, moves)
        if change is None:
            break
        steps.append(steps[-1] + change)
    return None if best is None else np.stack(steps[:best])


def _change(
    plan: CheckerPlan,
    q: NDArray[np.float64],
    jacobians: NDArray[np.float64],
    wanted: NDArray[np.float64],
    moves: NDArray[np.bool_],
) -> NDArray[np.float64] | None:
    """Return the least step ``(nq,)`` that changes distances as wanted, or None."""
    tree, columns = plan.tree, np.flatnonzero(moves)
    bounds = np.eye(len(columns))
    room = tree.upper[columns] - q[columns], q[columns] - tree.lower[columns]
    G = np.concatenate([jacobians[:, columns], -bounds, bounds])
    found = least_change(G, np.concatenate([wanted, -room[0], -room[1]]))
    if found is None:
        return None
    change = np.zeros(len(q))
    change[columns] = found * min(1.0, _LONGEST / float(np.abs(found).max(initial=_LONGEST)))
    return change


def least_change(G: NDArray[np.float64], h: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Return the shortest x ``(n,)`` with ``G x >= h`` for G ``(m, n)``; None where there is none.

    Rows whose h is -inf say nothing. Lawson and Hanson, *Solving Least Squares Problems*, 1974,
    chapter 23, problem LDP, by non-negative least squares.
    """
    from scipy.optimize import nnls  # late, since few starts collide

    says = np.isfinite(h)
    # Rows of one length, so that the answer does not depend on how far a joint's points reach.
    sizes = np.linalg.norm(G, axis=1)
    moved = says & (sizes > 0.0)
    if (h[says & ~moved] > 0.0).any():
        return None
    G, h = G[moved] / sizes[moved, np.newaxis], h[moved] / sizes[moved]
    if not (h > 0.0).any():
        return np.zeros(G.shape[1])
    E = np.concatenate([G.T, h[np.newaxis]])
    f = np.zeros(len(E))
    f[-1] = 1.0
    u, _ = nnls(E, f)
    r = E @ u - f
    if -r[-1] <= 1e-12:
        return None
    x: NDArray[np.float64] = -r[:-1] / r[-1]
    return x
