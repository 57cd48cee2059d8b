"""Which pairs have to be measured on eight stretches, as balls and boxes do not decide them."""

import math

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.compiled.lanes import (
    all_of,
    larger,
    load_lanes,
    select,
    smaller,
    store_lanes,
)
from scene_graph_ros.planning.edges.edge_stretches import COLLIDES, longest_of
from scene_graph_ros.planning.pairs.bodies import sure_distances
from scene_graph_ros.planning.pairs.inner_covers import farthest_apart
from scene_graph_ros.planning.pairs.separation_kernels import separations_at
from scene_graph_ros.planning.pairs.static_kernels import least_of
from scene_graph_ros.robots.tree_kernels import LANES

__all__ = ["find_open_pairs", "next_open_pair"]

_SURE = 1e-9
"""Metres: overlaps that are less deep are measured, as poses are rounded."""

_DEEPEST_FIRST = 16
"""Pairs that are taken in order of how deep their covers are in each other."""


@inlined_kernel
def _moved_on(bodies, motions, p, pairs, half):
    """Return bounds of the approach of a pair's bodies on stretches, in lanes."""
    a, bend = pairs.bodies[p, 0], motions.bends[p]
    moved = half * motions.ways[p]
    if bend < math.inf and pairs.bodies[p, 1] >= len(bodies.joints):
        speed = load_lanes(motions.speeds[a], 0)
        moved = smaller(moved, (speed + half * (0.5 * bend)) * half)
    return moved


@inlined_kernel
def _keep_open(stretches, p, count, slacks, rests):
    """Put the lanes of a pair that are not decided behind those that are open; return how many."""
    for k in range(LANES):
        if slacks[k] < 0.0:
            stretches.open[count], stretches.rests[count] = LANES * p + k, rests[k]
            count += 1
    return count


@inlined_kernel
def deepest_of(numbers, count):
    """Return the lane of the least of the first numbers, the first where there are several."""
    best = 0
    for k in range(1, count):
        if numbers[k] < numbers[best]:
            best = k
    return best


@inlined_kernel
def surely_collides(bodies, pairs, p, places):
    """Tell whether inner balls of two bodies overlap in any lane: ``work[2]`` has the depths."""
    most = farthest_apart(bodies, pairs.bodies[p, 0], pairs.bodies[p, 1], places)
    limit = pairs.paddings[p] - pairs.touching[p] - _SURE
    if all_of(most >= limit):
        return False
    store_lanes(places.work[2], 0, most)
    return True


@inlined_kernel
def find_open_pairs(bodies, pairs, motions, stretches, near_ones, rules, places):
    """Return (count, least): the number of open pairs and lanes, and a lower bound of all others.

    Written to ``stretches.open``, with the covers' slack beyond the padding in ``rests``.
    Unless all is to be measured, a collision that is certain ends it: then the count is -1, less
    the pair.
    """
    measures, part, tolerance = rules
    half = larger(load_lanes(stretches.below, 0), load_lanes(stretches.above, 0))
    is_over = half < 0.0
    longest = longest_of(stretches, LANES)
    scale, open_ones, least = longest / part, 0, math.inf
    for i in range(near_ones):
        p = i if near_ones == len(pairs.bodies) else places.near[i]
        a, b = pairs.bodies[p, 0], pairs.bodies[p, 1]
        way, padding = motions.ways[p], pairs.paddings[p]
        more = motions.margins[p] + tolerance + padding
        enough = scale * way + more
        sure = sure_distances(bodies, a, b, places, enough)
        if sure >= enough:
            least = min(least, sure - padding - longest * way)
            continue
        moved, apart = _moved_on(bodies, motions, p, pairs, half), load_lanes(places.sure, 0)
        needs = select(is_over, -math.inf, moved / part + more)
        if not all_of(apart >= needs):
            apart = larger(separations_at(bodies, a, b, places), apart)
        is_open = apart < needs
        kept = select(is_over | is_open, math.inf, apart - padding - moved)
        least = min(least, least_of(kept))
        if not all_of(apart >= needs):
            if not measures and surely_collides(bodies, pairs, p, places):
                k = deepest_of(places.work[2], LANES)
                stretches.states[k], stretches.blockers[k] = COLLIDES, p
                return -1 - p, least
            store_lanes(places.work[0], 0, apart - needs)
            store_lanes(places.work[1], 0, apart - padding)
            open_ones = _keep_open(stretches, p, open_ones, places.work[0], places.work[1])
    return open_ones, least


@inlined_kernel
def next_open_pair(stretches, count, taken):
    """Return the next of the open ones, and take it off the list.

    First those whose covers are deepest in each other, as they are the likeliest to collide.
    """
    best = count - 1
    if taken < _DEEPEST_FIRST:
        for i in range(count):
            if stretches.rests[i] < stretches.rests[best]:
                best = i
    row, rest = stretches.open[best], stretches.rests[best]
    stretches.open[best] = stretches.open[count - 1]
    stretches.rests[best] = stretches.rests[count - 1]
    return row // LANES, row % LANES, rest
