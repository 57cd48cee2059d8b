"""Proofs that whole edges between configurations are free, by distances and bounds of motion.

Where a pair is d apart in the middle of a stretch, and no point of one moves by more than d
relative to the other from there to the stretch's ends, the pair is apart on all of it. That is
conservative advancement (Mirtich, *Impulse-based Dynamic Simulation of Rigid Body Systems*, 1996,
section 2.3), here from the middle to both sides, eight stretches at a time.
"""

import math

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel, merged_kernel
from scene_graph_ros.geometry.compiled.lanes import larger, load_lanes, store_lanes
from scene_graph_ros.planning.edges.curve_kernels import point_on
from scene_graph_ros.planning.edges.edge_stretches import (
    COLLIDES,
    FREE,
    longest_of,
    MOST_STRETCHES,
    put,
    RECENT,
    UNDECIDED,
    UNFINISHED,
)
from scene_graph_ros.planning.edges.motion_kernels import (
    margin_of,
    place_speeds,
    place_twists,
    set_body_motions,
    set_pair_motions,
)
from scene_graph_ros.planning.edges.open_pairs import (
    deepest_of,
    find_open_pairs,
    next_open_pair,
    surely_collides,
)
from scene_graph_ros.planning.edges.pair_on_stretch import look_at_pair
from scene_graph_ros.planning.pairs.bodies import place_bodies, place_static_bodies, sure_distances
from scene_graph_ros.planning.pairs.check_kernels import collides_at, NO_PAIR
from scene_graph_ros.planning.pairs.separation_kernels import separations_at
from scene_graph_ros.planning.pairs.static_kernels import find_near
from scene_graph_ros.robots.tree_kernels import LANES

__all__ = ["prove_edge", "prove_edges"]

_STRETCH = 0.1
"""Metres that bodies move on a stretch that is looked at first, where an edge is short."""

_FINEST = 1e-9
"""Of an edge: between what is free and what is not no finer border is looked for."""


@inlined_kernel
def _place_middles(checked, edge, scratch, count, asks_ends):
    """Place all bodies as in the middles of stretches, or as at the edge's ends if it asks."""
    motions, stretches, places = scratch
    for k in range(LANES):
        place = (stretches.counts[0] + min(k, count - 1)) % MOST_STRETCHES
        low, high = stretches.ends[place, 0], stretches.ends[place, 1]
        middle = 0.5 * (low + high)
        if asks_ends and low == 0.0:
            middle = 0.0
        elif asks_ends and high == 1.0:
            middle = 1.0
        if k < count:
            stretches.low[k], stretches.middle[k], stretches.high[k] = low, middle, high
            stretches.below[k], stretches.above[k] = middle - low, high - middle
            stretches.states[k], stretches.blockers[k] = FREE, NO_PAIR
        else:
            stretches.below[k] = stretches.above[k] = -1.0
        point_on(checked.tree, edge, middle, motions.q[k])
    place_bodies(checked.tree, checked.bodies, motions.q, 0, checked.X_WB, places)


@merged_kernel
def _near_on(bodies, pairs, motions, longest, rules, places):
    """Return (count, least): the number of pairs to look at, and a lower bound of all others.

    That is on stretches that reach so far from their middles; ``places.near`` has these pairs.
    Without a tree that is all pairs.
    """
    part, tolerance = rules
    robots = len(bodies.joints)
    if len(bodies.nodes.radii) == 0:
        return len(pairs.bodies), math.inf
    for a in range(robots):
        enough = longest * motions.own[a, 0] / part + margin_of(motions.own[a, 2]) + tolerance
        places.limits[a] = enough + pairs.most_paddings[a]
    count, least = find_near(bodies, pairs, places, 1), math.inf
    for a in range(robots):
        if pairs.most_paddings[a] > -math.inf:
            beyond = places.slacks[a] + places.limits[a] - pairs.most_paddings[a]
            least = min(least, beyond - longest * motions.own[a, 0])
    return count, least


@merged_kernel
def _hits_again(checked, stretches, count, places):
    """Tell whether a pair that collided lately does so in one of the middles, and note it."""
    bodies, pairs = checked.bodies, checked.pairs
    for i in range(RECENT):
        p = stretches.recent[i]
        if p == NO_PAIR:
            return False
        a, b, padding = pairs.bodies[p, 0], pairs.bodies[p, 1], pairs.paddings[p]
        if sure_distances(bodies, a, b, places, padding) >= padding:
            continue
        apart = larger(separations_at(bodies, a, b, places), load_lanes(places.sure, 0))
        store_lanes(places.sure, 0, apart)
        deepest = deepest_of(places.sure, count)
        if places.sure[deepest] >= padding:
            continue
        if surely_collides(bodies, pairs, p, places):
            deepest, is_hit = deepest_of(places.work[2], count), True
        else:
            is_hit = collides_at(checked.held, bodies, pairs, p, deepest, places)
        if is_hit:
            stretches.states[deepest], stretches.blockers[deepest] = COLLIDES, p
            _remember(stretches, p)
            return True
    return False


@inlined_kernel
def _remember(stretches, p):
    """Put a pair that collides before those that did lately."""
    for i in range(RECENT):
        p, stretches.recent[i] = stretches.recent[i], p
        if p == stretches.recent[0]:
            return


@merged_kernel
def _look(checked, scratch, limits):
    """Write the extents around the middles where all pairs are free: ``below`` and ``above``.

    ``limits``: the rules. Returns a lower bound of all pairs there. Unless it is to be measured,
    a collision ends it.
    """
    motions, stretches, places = scratch
    bodies, pairs = checked.bodies, checked.pairs
    measures, part, tolerance = limits
    longest = longest_of(stretches, LANES)
    near_ones, kept_by_others = _near_on(
        bodies, pairs, motions, longest, (part, tolerance), places
    )
    count, least = find_open_pairs(bodies, pairs, motions, stretches, near_ones, limits, places)
    if count < 0:
        _remember(stretches, -1 - count)
        return least
    least, taken = min(least, kept_by_others), 0
    while count > 0:
        p, k, rest = next_open_pair(stretches, count, taken)
        count -= 1
        taken += 1
        if stretches.below[k] < 0.0:
            continue
        kept, _ = look_at_pair(checked, scratch, p, k, rest, (part, tolerance))
        if kept == -math.inf and not measures:
            _remember(stretches, p)
            return least
        if kept > -math.inf:
            least = min(least, kept)
    return least


@merged_kernel
def _look_at_middles(checked, edge, scratch, count, is_first, limits):
    """Find the same where all bodies are placed; ``limits`` ends with where nothing matters."""
    motions, stretches, places = scratch
    measures, part, tolerance, collision = limits
    if not measures and _hits_again(checked, stretches, count, places):
        return math.inf
    if is_first:
        tree, bodies = checked.tree, checked.bodies
        set_pair_motions(tree, bodies, checked.pairs, checked.reaches, edge, motions)
    if len(edge) == 2:
        place_twists(checked.tree, motions, places)
        place_speeds(checked.bodies, motions, places)
    for k in range(count):
        if stretches.low[k] > collision:
            stretches.below[k] = stretches.above[k] = -1.0
    return _look(checked, scratch, (measures, part, tolerance))


@inlined_kernel
def _put_rest(stretches, k, measures):
    """Put the unproven parts of a stretch behind those that wait; tell whether that helps."""
    low, middle, high = stretches.low[k], stretches.middle[k], stretches.high[k]
    if stretches.states[k] != FREE:
        half = 0.5 * (low + middle)
        is_coarse = measures and middle - low > _FINEST
        return is_coarse and put(stretches, low, half) and put(stretches, half, middle)
    has_room = True
    if stretches.below[k] < middle - low:
        has_room = put(stretches, low, middle - stretches.below[k])
    if stretches.above[k] < high - middle:
        has_room &= put(stretches, middle + stretches.above[k], high)
    return has_room


@inlined_kernel
def _first_parts(motions):
    """Return in how many stretches an edge is cut at first: LANES where it is long."""
    longest = 0.0
    for a in range(len(motions.own)):
        longest = max(longest, motions.own[a, 0])
    parts = 2
    while parts < LANES and parts * _STRETCH < longest:
        parts += 1
    return parts


@merged_kernel
def prove_edge(checked, edge, rules, stop, scratch, numbers):
    """Return (status, pair) of an edge and write its ``numbers``; see ``prove_edges``."""
    motions, stretches, _ = scratch
    measures, part, tolerance, asks_ends = rules
    stretches.counts[0] = stretches.counts[1] = 0
    set_body_motions(checked.tree, checked.bodies, checked.reaches, edge, motions)
    parts = _first_parts(motions)
    for i in range(parts):
        put(stretches, i / parts, (i + 1) / parts)
    undecided, undecided_pair, least = math.inf, NO_PAIR, math.inf
    collision, collision_pair = math.inf, NO_PAIR
    looks = 0
    while stretches.counts[1] > 0:
        count = min(LANES, stretches.counts[1])
        _place_middles(checked, edge, scratch, count, asks_ends and looks == 0)
        is_first, looks = looks == 0, looks + count
        limits = measures, part, tolerance, collision
        kept = _look_at_middles(checked, edge, scratch, count, is_first, limits)
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
        if looks >= stop[1] and stretches.counts[1] > 0:
            numbers[0] = numbers[1] = numbers[2] = 0.0
            return UNFINISHED, NO_PAIR
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
def prove_edges(checked, edges, rules, stop, proofs, scratch):
    """Prove edges ``(n, m, nq)`` to be free, or find where they collide; see ``point_on``.

    Writes of each edge its status; as numbers up to where it is proven, where it collides or could
    not be decided, a lower bound of its clearance, and how many configurations were looked at;
    and the pair. ``checked`` is a ``CheckedTables``, ``proofs`` an ``EdgeProofs``.

    Where the rules do not ask to measure, an edge is left as soon as it is known not to be free,
    and up to where it is tells nothing. Edges are undecided from when on another thread sets
    ``stop[0]``, and unfinished after ``stop[1]`` looks.
    """
    statuses, numbers, found = proofs
    place_static_bodies(checked.bodies, scratch.places)
    for e in range(len(edges)):
        scratch.stretches.recent[:] = NO_PAIR  # What is known of an edge depends on no other one.
        statuses[e], found[e] = prove_edge(checked, edges[e], rules, stop, scratch, numbers[e])
