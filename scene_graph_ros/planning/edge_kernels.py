"""Proofs that whole edges between configurations are free, by distances and bounds of motion.

Where a pair is d apart in the middle of a stretch, and no point of one moves by more than d
relative to the other from there to the stretch's ends, the pair is apart on all of it. That is
conservative advancement (Mirtich, *Impulse-based Dynamic Simulation of Rigid Body Systems*, 1996,
section 2.3), here from the middle to both sides, eight stretches at a time.
"""

import math
from typing import NamedTuple

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel, merged_kernel
from scene_graph_ros.planning.bodies import (
    distance_at,
    place_bodies,
    place_still_bodies,
    sure_distances,
)
from scene_graph_ros.planning.check_kernels import bounds_of, LOOSE, NO_PAIR
from scene_graph_ros.planning.curve_kernels import point_on, set_ways
from scene_graph_ros.robots.tree_kernels import LANES

__all__ = [
    "COLLIDES",
    "FREE",
    "UNDECIDED",
    "EdgeRules",
    "new_stretches",
    "prove_edge",
    "prove_edges",
]

COLLIDES = 0
FREE = 1
UNDECIDED = 2

MOST_STRETCHES = 4096
"""Stretches of an edge that wait to be looked at; an edge that needs more stays undecided."""

_FINEST = 1e-9
"""Of an edge: between what is free and what is not no finer border is looked for."""


class EdgeRules(NamedTuple):
    """What counts as proven, and how much is to be known."""

    measures: bool
    """Whether to find up to where an edge is free; else it is left once known not to be."""
    part: float
    """Of a distance, how much may be used up before it is measured again: what is left is kept."""
    tolerance: float
    """Metres: where less is left, an edge is undecided."""


class Stretches(NamedTuple):
    """The stretches of an edge that wait, in a ring, and those that are looked at; scratch."""

    ends: np.ndarray
    counts: np.ndarray
    """Where the ring begins, how many wait, and which pair last collided: it is asked first."""
    low: np.ndarray
    middle: np.ndarray
    high: np.ndarray
    free: np.ndarray
    blockers: np.ndarray
    halves: np.ndarray
    """How far around the middles all pairs looked at so far are free; negative where no longer."""


def new_stretches() -> Stretches:
    """Return scratch for one thread."""
    low, middle, high, free, halves = (np.empty(LANES) for _ in range(5))
    return Stretches(
        np.empty((MOST_STRETCHES, 2)),
        np.zeros(3, np.int64),
        low,
        middle,
        high,
        free,
        np.empty(LANES, np.int64),
        halves,
    )


@merged_kernel
def _free_way(held, bodies, pairs, p, k, places, need, tolerance):
    """Return how much nearer than now a pair may come, -inf where it collides.

    At least ``need``, where it is that. Never more than the truth.
    """
    padding = pairs.paddings[p]
    limit, reach = padding - pairs.touching[p], max(padding + need, 0.0)
    phi, _, _, _, _, gap, _ = distance_at(held, bodies, pairs, p, k, places, reach, LOOSE)
    least, most = bounds_of(phi, gap, reach)
    if most < limit:
        return -math.inf
    if least - padding < need and least - padding < max(tolerance, 0.5 * (most - padding)):
        phi, _, _, _, _, gap, _ = distance_at(held, bodies, pairs, p, k, places, reach, 0.0)
        if phi < limit:
            return -math.inf
        least, _ = bounds_of(phi, gap, reach)
    return least - padding


@inlined_kernel
def _put(stretches, low, high):
    """Put a stretch behind those that wait; tell whether there was room."""
    count = stretches.counts
    if count[1] >= MOST_STRETCHES - LANES:
        return False
    place = (count[0] + count[1]) % MOST_STRETCHES
    stretches.ends[place, 0], stretches.ends[place, 1] = low, high
    count[1] += 1
    return True


@inlined_kernel
def _place_middles(tree, bodies, stretches, count, is_first, edge, q, X_WB, places):
    """Place all bodies as in the middles of stretches, and first as at the edge's ends."""
    for k in range(LANES):
        place = (stretches.counts[0] + min(k, count - 1)) % MOST_STRETCHES
        low, high = stretches.ends[place, 0], stretches.ends[place, 1]
        middle = 0.5 * (low + high)
        if is_first and low == 0.0:
            middle = 0.0
        elif is_first and high == 1.0:
            middle = 1.0
        if k < count:
            stretches.low[k], stretches.middle[k], stretches.high[k] = low, middle, high
            stretches.free[k], stretches.blockers[k] = 1.0, NO_PAIR
        point_on(tree, edge, middle, q[k])
    place_bodies(tree, bodies, q, 0, X_WB, places)


@inlined_kernel
def _longest(halves, count):
    """Return how far around a middle anything is still to be shown."""
    longest = 0.0
    for k in range(count):
        longest = max(longest, halves[k])
    return longest


@merged_kernel
def _look(held, bodies, pairs, ways, margins, stretches, count, limits, places):
    """Find how far around the middles all pairs are free: ``free``, negative where one collides.

    ``limits``: the rules, and beyond where nothing matters any more. Returns what all pairs keep
    there at least. Unless it is to be measured, a collision ends it.
    """
    measures, part, tolerance, collision = limits
    least = math.inf
    low, middle, high = stretches.low, stretches.middle, stretches.high
    free, blockers, halves = stretches.free, stretches.blockers, stretches.halves
    for k in range(count):
        halves[k] = max(middle[k] - low[k], high[k] - middle[k])
        if low[k] > collision:
            halves[k] = -1.0
    first, count_of_pairs = stretches.counts[2], len(pairs.bodies)
    for i in range(count_of_pairs):
        p = first + i if first + i < count_of_pairs else first + i - count_of_pairs
        way, margin, padding = ways[p], margins[p], pairs.paddings[p]
        enough = _longest(halves, count) * way / part + margin + tolerance + padding
        sure_distances(bodies, pairs.bodies[p, 0], pairs.bodies[p, 1], places, enough)
        for k in range(count):
            if halves[k] < 0.0:
                continue
            need = halves[k] * way / part + margin + tolerance
            rest = places.sure[k] - padding
            if rest < need:
                rest = _free_way(held, bodies, pairs, p, k, places, need, tolerance)
            if rest == -math.inf:
                free[k], blockers[k], halves[k] = -1.0, p, -1.0
                if not measures:
                    stretches.counts[2] = p
                    return least
            elif rest >= need:
                least = min(least, rest - halves[k] * way)
            else:
                proven = 0.0
                if rest - margin >= tolerance:
                    proven = part * (rest - margin) / way
                    least = min(least, rest - proven * way)
                if proven < free[k]:
                    free[k], blockers[k] = proven, p
                    # Beyond what this pair leaves of the stretch, others need not be looked at.
                    halves[k] = min(halves[k], proven)
    return least


@inlined_kernel
def _put_rest(stretches, k, measures):
    """Put what is not proven of a stretch behind those that wait; tell whether that helps."""
    low, middle, high = stretches.low[k], stretches.middle[k], stretches.high[k]
    free = stretches.free[k]
    if free <= 0.0:
        half = 0.5 * (low + middle)
        is_coarse = measures and middle - low > _FINEST
        return is_coarse and _put(stretches, low, half) and _put(stretches, half, middle)
    has_room = True
    if middle - free > low:
        has_room = _put(stretches, low, middle - free)
    if middle + free < high:
        has_room &= _put(stretches, middle + free, high)
    return has_room


@merged_kernel
def prove_edge(
    held, tree, bodies, pairs, ways, margins, edge, X_WB, rules, stop, stretches, q, places,
    numbers,
):  # fmt: skip
    """Return (status, pair) of an edge and write its ``numbers``; see ``prove_edges``."""
    measures, part, tolerance = rules
    stretches.counts[0] = stretches.counts[1] = 0
    for i in range(LANES):
        _put(stretches, i / LANES, (i + 1) / LANES)
    undecided, undecided_pair, least = math.inf, NO_PAIR, math.inf
    collision, collision_pair = math.inf, NO_PAIR
    looks = 0
    while stretches.counts[1] > 0:
        count = min(LANES, stretches.counts[1])
        _place_middles(tree, bodies, stretches, count, looks == 0, edge, q, X_WB, places)
        looks += count
        kept = _look(
            held, bodies, pairs, ways, margins, stretches, count,
            (measures, part, tolerance, collision), places,
        )  # fmt: skip
        least = min(least, kept)
        stretches.counts[0] += count
        stretches.counts[1] -= count
        for k in range(count):
            low, blocker = stretches.low[k], stretches.blockers[k]
            if stretches.free[k] < 0.0 and stretches.middle[k] < collision:
                collision, collision_pair = stretches.middle[k], blocker
            elif stretches.free[k] == 0.0 and stretches.middle[k] < undecided:
                undecided, undecided_pair = stretches.middle[k], blocker
            if low < min(undecided, collision) and not _put_rest(stretches, k, measures):
                undecided, undecided_pair = low, blocker
        if not measures and min(collision, undecided) < math.inf:
            break
        if stop[0] != 0:
            undecided = min(undecided, 0.0)
            break
    numbers[2], numbers[3] = 0.0, looks
    if collision < math.inf:
        numbers[0], numbers[1] = min(undecided, collision), collision
        return COLLIDES, collision_pair
    if undecided < math.inf:
        numbers[0] = numbers[1] = undecided
        return UNDECIDED, undecided_pair
    numbers[0] = numbers[1] = 1.0
    numbers[2] = least
    return FREE, NO_PAIR


@lean_kernel
def prove_edges(
    held, tree, bodies, pairs, reaches, edges, X_WB, rules, stop, statuses, numbers, found,
    scratch, stretches, places,
):  # fmt: skip
    """Prove edges ``(n, m, nq)`` to be free, or find where they collide; see ``point_on``.

    Writes statuses ``(n,)``; in ``numbers`` ``(n, 4)`` up to where an edge is proven, where it
    collides or could not be decided, what it certainly stays away from, and how many
    configurations were looked at; in ``found`` ``(n,)`` the pair. Where the rules do not ask to
    measure, an edge is left as soon as it is known not to be free, and up to where it is tells
    nothing. Edges are undecided from when on another thread sets ``stop`` ``(1,)``.
    """
    ways, margins, own, q = scratch
    place_still_bodies(bodies, places)
    for e in range(len(edges)):
        set_ways(tree, bodies, pairs, reaches, edges[e], ways, margins, own)
        stretches.counts[2] = 0  # What is known of an edge depends on no other one.
        statuses[e], found[e] = prove_edge(
            held, tree, bodies, pairs, ways, margins, edges[e], X_WB, rules, stop, stretches, q,
            places, numbers[e],
        )  # fmt: skip
