"""How far around the middle of a stretch one pair is free, by the cheapest bound that decides."""

import math

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, merged_kernel
from scene_graph_ros.geometry.spatial.vectors import scale
from scene_graph_ros.geometry.tables.held_table import borrowed_table
from scene_graph_ros.planning.edges.edge_stretches import COLLIDES, FREE, UNDECIDED
from scene_graph_ros.planning.edges.motion_kernels import speed_bounds, time_until, used_up
from scene_graph_ros.planning.pairs.bodies import distance_at
from scene_graph_ros.planning.pairs.check_kernels import bounds_of, LOOSE
from scene_graph_ros.planning.pairs.separation_kernels import separation

__all__ = ["look_at_pair"]

_FINE = 1e-4
"""Of a distance: with a larger error its direction is too uncertain."""


@inlined_kernel
def _into_first(pairs, p, n):
    """Return a normal out of B into A that is given as ``distance_at`` does."""
    return scale(-1.0 if pairs.swaps[p] else 1.0, n)


@inlined_kernel
def _slack(checked, p, phi, error):
    """Return the largest error of a normal's direction, infinite where unknown.

    Of two convex bodies, d apart, no two points are nearer to each other along that direction.
    So points that are ``phi`` apart, and in the bodies to within ``error``, are apart along a
    direction whose cosine with it is at least ``1 - 3 error / phi``.
    """
    table, rows = borrowed_table(checked.held), checked.bodies.rows
    a, b = checked.pairs.bodies[p, 0], checked.pairs.bodies[p, 1]
    if not 0.0 < phi < math.inf or table.exact[rows[a]] or table.exact[rows[b]]:
        return math.inf
    return math.sqrt(8.0 * error / phi)


@merged_kernel
def _free_way(checked, p, k, places, need, margin):
    """Return (rest, slack, n): how much nearer than now a pair may come, -inf where it collides.

    At least ``need``, where it is that. Never more than the truth. ``n`` is a unit vector in W
    out of B into A; see ``_slack``.
    """
    held, bodies, pairs = checked.held, checked.bodies, checked.pairs
    padding = pairs.paddings[p]
    limit, reach = padding - pairs.touching[p], max(padding + need, 0.0)
    phi, _, _, nhat, gap = distance_at(held, bodies, pairs, p, k, places, reach, LOOSE)
    least, most = bounds_of(phi, gap, reach)
    if most < limit:
        return -math.inf, math.inf, nhat
    if least - padding < need and gap > _FINE * phi:
        phi, _, _, nhat, gap = distance_at(held, bodies, pairs, p, k, places, reach, 0.0)
        if phi < limit:
            return -math.inf, math.inf, nhat
        least, _ = bounds_of(phi, gap, reach)
    slack = math.inf
    if least - padding < need:
        slack = _slack(checked, p, phi, gap + margin)
    return least - padding, slack, _into_first(pairs, p, nhat)


@inlined_kernel
def _free_times(checked, scratch, p, k, rest, slack, n, part):
    """Return when a pair may have used up a part of its rest, before and behind the middle.

    That is (before, behind, backwards, forwards, bend); the last three say how fast at most.
    """
    motions = scratch.motions
    way, bend, may = motions.ways[p], motions.bends[p], part * (rest - motions.margins[p])
    before = behind = may / way if way > 0.0 else math.inf
    if slack >= 1.0 or bend == math.inf:
        return before, behind, way, way, math.inf
    forwards, backwards = speed_bounds(
        checked.bodies, checked.pairs, p, k, motions, scratch.places, n, slack
    )
    before = max(before, time_until(may, backwards, bend))
    behind = max(behind, time_until(may, forwards, bend))
    return before, behind, backwards, forwards, bend


@inlined_kernel
def _kept(motions, stretches, p, k, rest, times):
    """Return a lower bound of a pair's distance on the unproven part of a stretch."""
    _, _, backwards, forwards, bend = times
    way = motions.ways[p]
    return rest - max(
        used_up(stretches.below[k], way, backwards, bend),
        used_up(stretches.above[k], way, forwards, bend),
    )


@inlined_kernel
def _shrink(stretches, times, p, k):
    """Shrink a stretch to the part that a pair leaves free; return its extent, if it is less."""
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
def look_at_pair(checked, scratch, p, k, rest, limits):
    """Shrink a stretch to the part that a pair leaves free, by the cheapest bound that decides.

    ``rest`` (m) is its covers' slack beyond the padding. Returns a lower bound of the pair
    there, -inf where it collides in the middle, and the extent of the remainder from the middle,
    infinite where all is.
    """
    motions, stretches, places = scratch
    bodies, pairs = checked.bodies, checked.pairs
    part, tolerance = limits
    below, above = stretches.below, stretches.above
    way, bend = motions.ways[p], motions.bends[p]
    margin, padding = motions.margins[p], pairs.paddings[p]
    a, b = pairs.bodies[p, 0], pairs.bodies[p, 1]
    half = max(below[k], above[k])
    need = half * way / part + margin + tolerance
    if rest >= need:
        return rest - half * way, math.inf
    if bend < math.inf and b >= len(bodies.joints):
        moved = (motions.speeds[a, k] + 0.5 * bend * half) * half
        if rest >= moved / part + margin + tolerance:
            return rest - moved, math.inf
    if rest - margin >= tolerance:
        apart, n = separation(bodies, a, b, places, k)
        rest = apart - padding
    if rest - margin >= tolerance:
        times = _free_times(checked, scratch, p, k, rest, 0.0, n, part)
        if times[0] >= below[k] and times[1] >= above[k]:
            return _kept(motions, stretches, p, k, rest, times), math.inf
    rest, slack, n = _free_way(checked, p, k, places, need, margin)
    if rest >= need:
        return rest - half * way, math.inf
    if rest - margin >= tolerance:
        times = _free_times(checked, scratch, p, k, rest, slack, n, part)
        nearest = _shrink(stretches, times, p, k)
        return _kept(motions, stretches, p, k, rest, times), nearest
    is_collision = rest == -math.inf
    below[k] = above[k] = -1.0 if is_collision else 0.0
    if is_collision or stretches.states[k] == FREE:
        stretches.states[k] = COLLIDES if is_collision else UNDECIDED
        stretches.blockers[k] = p
    return (-math.inf if is_collision else math.inf), 0.0
