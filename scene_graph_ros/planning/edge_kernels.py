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
from scene_graph_ros.robots.tree_kernels import FLOATING, LANES, PLANAR, PRISMATIC, REVOLUTE

__all__ = [
    "COLLIDES",
    "FREE",
    "UNDECIDED",
    "EdgeRules",
    "interpolate",
    "new_stretches",
    "prove_edge",
    "prove_edges",
    "set_ways",
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


_ROUNDING = 1e-12
"""Metres that are kept free for what rounding moves links by, times their reach in metres."""


@inlined_kernel
def interpolate(tree, q1, q2, t, out):
    """Write the configuration at t between two; quaternions turn the short way at one speed."""
    for i in range(len(q1)):
        out[i] = (1.0 - t) * q1[i] + t * q2[i]
    for j in range(1, len(tree.kinds)):
        if tree.kinds[j] == FLOATING:
            s = tree.starts[j]
            angle, sign, size1, size2 = _half_turn(q1, q2, s)
            a, b = 1.0 - t, sign * t
            if angle > 1e-4:
                a, b = (
                    math.sin(a * angle) / math.sin(angle),
                    sign * math.sin(t * angle) / math.sin(angle),
                )
            for i in range(s, s + 4):
                out[i] = a * q1[i] / size1 + b * q2[i] / size2


@inlined_kernel
def _half_turn(q1, q2, s):
    """Return half the angle between two quaternions, the sign that makes it short, and lengths."""
    dot = size1 = size2 = 0.0
    for i in range(s, s + 4):
        size1 += q1[i] * q1[i]
        size2 += q2[i] * q2[i]
    size1, size2 = math.sqrt(size1), math.sqrt(size2)
    for i in range(s, s + 4):
        dot += q1[i] / size1 * (q2[i] / size2)
    sign = 1.0 if dot >= 0.0 else -1.0
    apart = 0.0
    for i in range(s, s + 4):
        apart += (q1[i] / size1 - sign * q2[i] / size2) ** 2
    return 2.0 * math.asin(min(1.0, 0.5 * math.sqrt(apart))), sign, size1, size2


@inlined_kernel
def _way_of(tree, joint, last, reach, q1, q2):
    """Return how far any point of a body can move along an edge, and how far out it may be.

    Relative to the joint ``last``; ``reach`` is the largest distance of the body's points from the
    origin of its own joint. Each joint moves what is behind it by its turn times the largest
    distance from its axis, and by its slide.
    """
    way = 0.0
    while joint != last:
        kind, s, factor = tree.kinds[joint], tree.starts[joint], tree.multipliers[joint]
        slide = 0.0
        if kind == REVOLUTE:
            way += abs(factor * (q2[s] - q1[s])) * reach
        elif kind == PRISMATIC:
            offset = tree.offsets[joint]
            way += abs(factor * (q2[s] - q1[s]))
            slide = max(abs(factor * q1[s] + offset), abs(factor * q2[s] + offset))
        elif kind == PLANAR:
            way += math.hypot(q2[s] - q1[s], q2[s + 1] - q1[s + 1])
            way += abs(q2[s + 2] - q1[s + 2]) * reach
            slide = max(math.hypot(q1[s], q1[s + 1]), math.hypot(q2[s], q2[s + 1]))
        else:
            angle, _, _, _ = _half_turn(q1, q2, s)
            way += 2.0 * angle * reach
            dx, dy, dz = q2[s + 4] - q1[s + 4], q2[s + 5] - q1[s + 5], q2[s + 6] - q1[s + 6]
            way += math.sqrt(dx * dx + dy * dy + dz * dz)
            for q in (q1, q2):
                far = math.sqrt(q[s + 4] ** 2 + q[s + 5] ** 2 + q[s + 6] ** 2)
                slide = max(slide, far)
        X = tree.X_PJ[joint]
        reach += slide + math.sqrt(X[0, 3] ** 2 + X[1, 3] ** 2 + X[2, 3] ** 2)
        joint = tree.parents[joint]
    return way, reach


@inlined_kernel
def set_ways(tree, bodies, pairs, reaches, q1, q2, ways, margins, own):
    """Write, for each pair, how far it can move along an edge, and what rounding is allowed.

    ``own`` ``(r, 2)`` is scratch: the same of each body of a robot, against what does not move.
    """
    robots = len(bodies.joints)
    for a in range(robots):
        own[a, 0], own[a, 1] = _way_of(tree, bodies.joints[a], 0, reaches[a], q1, q2)
    for p in range(len(pairs.bodies)):
        a, b = pairs.bodies[p, 0], pairs.bodies[p, 1]
        way, reach = own[a, 0], own[a, 1]
        if b < robots:
            way, reach = _way_of(tree, bodies.joints[a], pairs.shared[p], reaches[a], q1, q2)
            more, other = _way_of(tree, bodies.joints[b], pairs.shared[p], reaches[b], q1, q2)
            way, reach = way + more, max(reach, other)
        ways[p], margins[p] = way, _ROUNDING * (1.0 + reach)


@merged_kernel
def _free_way(held, bodies, pairs, p, k, places, need, tolerance, work):
    """Return how much nearer than now a pair may come, -inf where it collides.

    At least ``need``, where it is that. Never more than the truth.
    """
    padding = pairs.paddings[p]
    limit, reach = padding - pairs.touching[p], max(padding + need, 0.0)
    phi, _, _, _, _, gap, _ = distance_at(held, bodies, pairs, p, k, places, reach, LOOSE, work)
    least, most = bounds_of(phi, gap, reach)
    if most < limit:
        return -math.inf
    if least - padding < need and least - padding < max(tolerance, 0.5 * (most - padding)):
        phi, _, _, _, _, gap, _ = distance_at(held, bodies, pairs, p, k, places, reach, 0.0, work)
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
def _place_middles(tree, bodies, stretches, count, is_first, q1, q2, q, X_WB, places):
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
        interpolate(tree, q1, q2, middle, q[k])
    place_bodies(tree, bodies, q, 0, X_WB, places)


@inlined_kernel
def _longest(halves, count):
    """Return how far around a middle anything is still to be shown."""
    longest = 0.0
    for k in range(count):
        longest = max(longest, halves[k])
    return longest


@merged_kernel
def _look(held, bodies, pairs, ways, margins, stretches, count, limits, places, work):
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
                rest = _free_way(held, bodies, pairs, p, k, places, need, tolerance, work)
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
    held, tree, bodies, pairs, ways, margins, q1, q2, X_WB, rules, stop, stretches, q, places,
    work, numbers,
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
        _place_middles(tree, bodies, stretches, count, looks == 0, q1, q2, q, X_WB, places)
        looks += count
        kept = _look(
            held, bodies, pairs, ways, margins, stretches, count,
            (measures, part, tolerance, collision), places, work,
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
    scratch, stretches, places, work,
):  # fmt: skip
    """Prove edges ``(n, 2, nq)`` to be free, or find where they collide.

    Writes statuses ``(n,)``; in ``numbers`` ``(n, 4)`` up to where an edge is proven, where it
    collides or could not be decided, what it certainly stays away from, and how many
    configurations were looked at; in ``found`` ``(n,)`` the pair. Where the rules do not ask to
    measure, an edge is left as soon as it is known not to be free, and up to where it is tells
    nothing. Edges are undecided from when on another thread sets ``stop`` ``(1,)``.
    """
    ways, margins, own, q = scratch
    place_still_bodies(bodies, places)
    for e in range(len(edges)):
        q1, q2 = edges[e, 0], edges[e, 1]
        set_ways(tree, bodies, pairs, reaches, q1, q2, ways, margins, own)
        stretches.counts[2] = 0  # What is known of an edge depends on no other one.
        statuses[e], found[e] = prove_edge(
            held, tree, bodies, pairs, ways, margins, q1, q2, X_WB, rules, stop, stretches, q,
            places, work, numbers[e],
        )  # fmt: skip
