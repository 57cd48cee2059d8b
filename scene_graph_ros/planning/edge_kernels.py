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
from scene_graph_ros.geometry.tables.held_table import borrowed_table
from scene_graph_ros.planning.bodies import (
    distance_at,
    place_bodies,
    place_still_bodies,
    sure_distances,
)
from scene_graph_ros.planning.check_kernels import bounds_of, LOOSE, NO_PAIR
from scene_graph_ros.planning.curve_kernels import point_on
from scene_graph_ros.planning.motion_kernels import (
    margin_of,
    place_speeds,
    place_twists,
    set_motions,
    speed_bounds,
    time_until,
    used_up,
)
from scene_graph_ros.planning.separation_kernels import separation
from scene_graph_ros.planning.still_kernels import find_near
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

_FINE = 1e-4
"""Of a distance: with a larger error its direction is too uncertain."""

_STRETCH = 0.1
"""Metres that bodies move on a stretch that is looked at first, where an edge is short."""

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
    """Where the ring begins, how many wait, and which pair was in the way: it is asked first."""
    low: np.ndarray
    middle: np.ndarray
    high: np.ndarray
    below: np.ndarray
    """How far before the middles all pairs looked at so far are free; negative where no longer."""
    above: np.ndarray
    """The same behind them."""
    states: np.ndarray
    """FREE, unless a pair collides or is too near in the middle."""
    blockers: np.ndarray


def new_stretches() -> Stretches:
    """Return scratch for one thread."""
    low, middle, high, below, above = (np.empty(LANES) for _ in range(5))
    return Stretches(
        np.empty((MOST_STRETCHES, 2)),
        np.zeros(3, np.int64),
        low,
        middle,
        high,
        below,
        above,
        np.empty(LANES, np.int64),
        np.empty(LANES, np.int64),
    )


@inlined_kernel
def _in_world(pairs, p, k, places, n):
    """Return a normal in W, out of B into A, that is given as ``distance_pair`` does."""
    swaps = pairs.swaps[p]
    X = places.X_WG[pairs.bodies[p, 1] if swaps else pairs.bodies[p, 0]]
    sign = -1.0 if swaps else 1.0
    return (
        sign * (X[0, k] * n[0] + X[1, k] * n[1] + X[2, k] * n[2]),
        sign * (X[4, k] * n[0] + X[5, k] * n[1] + X[6, k] * n[2]),
        sign * (X[8, k] * n[0] + X[9, k] * n[1] + X[10, k] * n[2]),
    )


@inlined_kernel
def _slack(held, bodies, pairs, p, phi, error):
    """Return how far a normal may be off the direction of the distance, infinite where unknown.

    Of two convex bodies, d apart, no two points are nearer to each other along that direction.
    So points that are ``phi`` apart, and in the bodies to within ``error``, are apart along a
    direction whose cosine with it is at least ``1 - 3 error / phi``.
    """
    table, a, b = borrowed_table(held), pairs.bodies[p, 0], pairs.bodies[p, 1]
    if not 0.0 < phi < math.inf or table.exact[bodies.rows[a]] or table.exact[bodies.rows[b]]:
        return math.inf
    return math.sqrt(8.0 * error / phi)


@merged_kernel
def _free_way(held, bodies, pairs, p, k, places, need, tolerance, margin):
    """Return (rest, slack, n): how much nearer than now a pair may come, -inf where it collides.

    At least ``need``, where it is that. Never more than the truth. ``n`` is a unit vector in W
    out of B into A; see ``_slack``.
    """
    padding = pairs.paddings[p]
    limit, reach = padding - pairs.touching[p], max(padding + need, 0.0)
    phi, _, _, nhat, _, gap, _ = distance_at(held, bodies, pairs, p, k, places, reach, LOOSE)
    least, most = bounds_of(phi, gap, reach)
    if most < limit:
        return -math.inf, math.inf, nhat
    if least - padding < need and gap > _FINE * phi:
        phi, _, _, nhat, _, gap, _ = distance_at(held, bodies, pairs, p, k, places, reach, 0.0)
        if phi < limit:
            return -math.inf, math.inf, nhat
        least, _ = bounds_of(phi, gap, reach)
    slack = math.inf
    if least - padding < need:
        slack = _slack(held, bodies, pairs, p, phi, gap + margin)
    return least - padding, slack, _in_world(pairs, p, k, places, nhat)


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
def _place_middles(tree, bodies, stretches, count, is_first, edge, motions, X_WB, places):
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
            stretches.below[k], stretches.above[k] = middle - low, high - middle
            stretches.states[k], stretches.blockers[k] = FREE, NO_PAIR
        point_on(tree, edge, middle, motions.q[k])
    place_bodies(tree, bodies, motions.q, 0, X_WB, places)
    if len(edge) == 2:
        place_twists(tree, motions, places)
        place_speeds(bodies, motions, places)


@inlined_kernel
def _longest(stretches, count):
    """Return how far around a middle anything is still to be shown."""
    longest = 0.0
    for k in range(count):
        longest = max(longest, stretches.below[k], stretches.above[k])
    return longest


@inlined_kernel
def _free_times(bodies, pairs, motions, p, k, places, rest, slack, n, part):
    """Return when a pair may have used up a part of its rest, before and behind the middle.

    That is (before, behind, backwards, forwards, bend); the last three say how fast at most.
    """
    way, bend, may = motions.ways[p], motions.bends[p], part * (rest - motions.margins[p])
    before = behind = may / way if way > 0.0 else math.inf
    if slack >= 1.0 or bend == math.inf:
        return before, behind, way, way, math.inf
    forwards, backwards = speed_bounds(bodies, pairs, p, k, motions, places, n, slack)
    before = max(before, time_until(may, backwards, bend))
    behind = max(behind, time_until(may, forwards, bend))
    return before, behind, backwards, forwards, bend


@inlined_kernel
def _kept(motions, stretches, p, k, rest, times):
    """Return what a pair keeps on all that is still to be shown of a stretch."""
    _, _, backwards, forwards, bend = times
    way = motions.ways[p]
    return rest - max(
        used_up(stretches.below[k], way, backwards, bend),
        used_up(stretches.above[k], way, forwards, bend),
    )


@inlined_kernel
def _shrink(stretches, times, p, k):
    """Leave of a stretch what a pair leaves free; return how far that is, if it is less."""
    before, behind, nearest = times[0], times[1], math.inf
    if before < stretches.below[k]:
        stretches.below[k] = nearest = before
    if behind < stretches.above[k]:
        stretches.above[k] = behind
        nearest = min(nearest, behind)
    if nearest < math.inf and stretches.states[k] == FREE:
        stretches.blockers[k] = p
    return nearest


@merged_kernel
def _look_at(held, bodies, pairs, motions, stretches, p, k, limits, places):
    """Leave of a stretch what a pair leaves free, by the cheapest bound that decides.

    Returns what the pair keeps there at least, -inf where it collides in the middle, and how far
    from the middle what is left ends, infinite where all is.
    """
    part, tolerance = limits
    below, above = stretches.below, stretches.above
    way, bend = motions.ways[p], motions.bends[p]
    margin, padding = motions.margins[p], pairs.paddings[p]
    a, b = pairs.bodies[p, 0], pairs.bodies[p, 1]
    half = max(below[k], above[k])
    need, rest = half * way / part + margin + tolerance, places.sure[k] - padding
    if rest >= need:
        return rest - half * way, math.inf
    if bend < math.inf and b >= len(bodies.joints):
        moved = (motions.speeds[a, k] + 0.5 * bend * half) * half
        if rest >= moved / part + margin + tolerance:
            return rest - moved, math.inf
    apart, n = separation(bodies, a, b, places, k)
    rest = apart - padding
    if rest - margin >= tolerance:
        times = _free_times(bodies, pairs, motions, p, k, places, rest, 0.0, n, part)
        if times[0] >= below[k] and times[1] >= above[k]:
            return _kept(motions, stretches, p, k, rest, times), math.inf
    rest, slack, n = _free_way(held, bodies, pairs, p, k, places, need, tolerance, margin)
    if rest >= need:
        return rest - half * way, math.inf
    if rest - margin >= tolerance:
        times = _free_times(bodies, pairs, motions, p, k, places, rest, slack, n, part)
        nearest = _shrink(stretches, times, p, k)
        return _kept(motions, stretches, p, k, rest, times), nearest
    is_collision = rest == -math.inf
    below[k] = above[k] = -1.0 if is_collision else 0.0
    if is_collision or stretches.states[k] == FREE:
        stretches.states[k] = COLLIDES if is_collision else UNDECIDED
        stretches.blockers[k] = p
    return (-math.inf if is_collision else math.inf), 0.0


@merged_kernel
def _near_on(bodies, pairs, motions, longest, rules, first, places):
    """Return (count, first, least): which pairs have to be looked at, and what all others keep.

    That is on stretches that reach so far from their middles; ``places.near`` has these pairs, and
    they are looked at from the row ``first`` on. Without a tree that is all pairs.
    """
    part, tolerance = rules
    robots = len(bodies.joints)
    if len(bodies.nodes.radii) == 0:
        return len(pairs.bodies), first, math.inf
    for a in range(robots):
        enough = longest * motions.own[a, 0] / part + margin_of(motions.own[a, 2]) + tolerance
        places.limits[a] = enough + pairs.most_paddings[a]
    count, least, row = find_near(bodies, pairs, places, 1), math.inf, 0
    for a in range(robots):
        beyond = places.slacks[a] + places.limits[a] - pairs.most_paddings[a]
        least = min(least, beyond - longest * motions.own[a, 0])
    while row < count and places.near[row] < first:
        row += 1
    return count, row, least


@inlined_kernel
def _pair_at(i, count, pairs, places):
    """Return a pair in a round through those that have to be looked at."""
    row = i if i < count else i - count
    return row if count == len(pairs.bodies) else places.near[row]


@merged_kernel
def _look(held, bodies, pairs, motions, stretches, count, limits, places):
    """Find how far around the middles all pairs are free: ``below`` and ``above``.

    ``limits``: the rules, and beyond where nothing matters any more. Returns what all pairs keep
    there at least. Unless it is to be measured, a collision ends it.
    """
    measures, part, tolerance, collision = limits
    tightest = math.inf
    for k in range(count):
        if stretches.low[k] > collision:
            stretches.below[k] = stretches.above[k] = -1.0
    longest = _longest(stretches, count)
    near_ones, first, least = _near_on(
        bodies, pairs, motions, longest, (part, tolerance), stretches.counts[2], places
    )
    scale = longest / part
    for i in range(near_ones):
        p = _pair_at(first + i, near_ones, pairs, places)
        way, margin, padding = motions.ways[p], motions.margins[p], pairs.paddings[p]
        enough = scale * way + margin + tolerance + padding
        sure = sure_distances(bodies, pairs.bodies[p, 0], pairs.bodies[p, 1], places, enough)
        if sure >= enough:
            least = min(least, sure - padding - longest * way)
            continue
        for k in range(count):
            if stretches.below[k] < 0.0:
                continue
            kept, nearest = _look_at(
                held, bodies, pairs, motions, stretches, p, k, (part, tolerance), places
            )
            if nearest < tightest:
                tightest, stretches.counts[2] = nearest, p
            if kept == -math.inf and not measures:
                return least
            if kept > -math.inf:
                least = min(least, kept)
            if nearest < math.inf:
                longest = _longest(stretches, count)
                scale = longest / part
    return least


@inlined_kernel
def _put_rest(stretches, k, measures):
    """Put what is not proven of a stretch behind those that wait; tell whether that helps."""
    low, middle, high = stretches.low[k], stretches.middle[k], stretches.high[k]
    if stretches.states[k] != FREE:
        half = 0.5 * (low + middle)
        is_coarse = measures and middle - low > _FINEST
        return is_coarse and _put(stretches, low, half) and _put(stretches, half, middle)
    has_room = True
    if stretches.below[k] < middle - low:
        has_room = _put(stretches, low, middle - stretches.below[k])
    if stretches.above[k] < high - middle:
        has_room &= _put(stretches, middle + stretches.above[k], high)
    return has_room


@inlined_kernel
def _first_parts(motions):
    """Return in how many stretches an edge is cut at first: LANES where it is long."""
    longest = 0.0
    for p in range(len(motions.ways)):
        longest = max(longest, motions.ways[p])
    parts = 2
    while parts < LANES and parts * _STRETCH < longest:
        parts += 1
    return parts


@merged_kernel
def prove_edge(
    held, tree, bodies, pairs, motions, edge, X_WB, rules, stop, stretches, places, numbers
):
    """Return (status, pair) of an edge and write its ``numbers``; see ``prove_edges``."""
    measures, part, tolerance = rules
    stretches.counts[0] = stretches.counts[1] = 0
    parts = _first_parts(motions)
    for i in range(parts):
        _put(stretches, i / parts, (i + 1) / parts)
    undecided, undecided_pair, least = math.inf, NO_PAIR, math.inf
    collision, collision_pair = math.inf, NO_PAIR
    looks = 0
    while stretches.counts[1] > 0:
        count = min(LANES, stretches.counts[1])
        _place_middles(tree, bodies, stretches, count, looks == 0, edge, motions, X_WB, places)
        looks += count
        kept = _look(
            held, bodies, pairs, motions, stretches, count,
            (measures, part, tolerance, collision), places,
        )  # fmt: skip
        least = min(least, kept)
        stretches.counts[0] += count
        stretches.counts[1] -= count
        for k in range(count):
            low, state, blocker = stretches.low[k], stretches.states[k], stretches.blockers[k]
            if state == COLLIDES and stretches.middle[k] < collision:
                collision, collision_pair = stretches.middle[k], blocker
            elif state == UNDECIDED and stretches.middle[k] < undecided:
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
    motions, stretches, places,
):  # fmt: skip
    """Prove edges ``(n, m, nq)`` to be free, or find where they collide; see ``point_on``.

    Writes statuses ``(n,)``; in ``numbers`` ``(n, 4)`` up to where an edge is proven, where it
    collides or could not be decided, what it certainly stays away from, and how many
    configurations were looked at; in ``found`` ``(n,)`` the pair. Where the rules do not ask to
    measure, an edge is left as soon as it is known not to be free, and up to where it is tells
    nothing. Edges are undecided from when on another thread sets ``stop`` ``(1,)``.
    """
    place_still_bodies(bodies, places)
    for e in range(len(edges)):
        set_motions(tree, bodies, pairs, reaches, edges[e], motions)
        stretches.counts[2] = 0  # What is known of an edge depends on no other one.
        statuses[e], found[e] = prove_edge(
            held, tree, bodies, pairs, motions, edges[e], X_WB, rules, stop, stretches, places,
            numbers[e],
        )  # fmt: skip
