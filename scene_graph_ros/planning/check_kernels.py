"""Which configurations are free: by balls and boxes where these suffice, else exactly."""

import math

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel, merged_kernel
from scene_graph_ros.planning.bodies import (
    distance_at,
    place_bodies,
    place_still_bodies,
    sure_distances,
)
from scene_graph_ros.planning.still_kernels import find_near
from scene_graph_ros.robots.tree_kernels import LANES

__all__ = [
    "LOOSE",
    "NO_PAIR",
    "bounds_of",
    "check_by_tree",
    "check_configurations",
]

NO_PAIR = -1

LOOSE = 1e-3
"""Relative to the larger size: a first look at a distance, whose sign is certain."""


@inlined_kernel
def bounds_of(phi, gap, reach):
    """Return what a distance is at least and at most; beyond ``reach`` it is a lower bound."""
    if phi > reach and gap == math.inf:
        return phi, math.inf
    return phi - gap, phi + gap


@merged_kernel
def _collides_at(held, bodies, pairs, p, k, places):
    """Tell whether a pair is nearer than its padding in configuration k.

    Without padding that is what ``has_collisions`` calls a collision. A first look decides all but
    what is within its error of the padding.
    """
    limit, reach = pairs.paddings[p] - pairs.touching[p], max(pairs.paddings[p], 0.0)
    phi, _, _, _, _, gap, _ = distance_at(held, bodies, pairs, p, k, places, reach, LOOSE)
    least, most = bounds_of(phi, gap, reach)
    if least >= limit:
        return False
    if most < limit:
        return True
    phi, _, _, _, _, _, _ = distance_at(held, bodies, pairs, p, k, places, reach, 0.0)
    return phi < limit


@lean_kernel
def check_configurations(
    held, tree, bodies, pairs, q, X_WB, first_pair, places
):  # fmt: skip
    """Write the first pair that is nearer than its padding, or NO_PAIR, for each configuration."""
    n = len(q)
    place_still_bodies(bodies, places)
    for first in range(0, n, LANES):
        place_bodies(tree, bodies, q, first, X_WB, places)
        count = min(LANES, n - first)
        open_ones = count
        for k in range(count):
            first_pair[first + k] = NO_PAIR
        for p in range(len(pairs.bodies)):
            a, b, padding = pairs.bodies[p, 0], pairs.bodies[p, 1], pairs.paddings[p]
            if sure_distances(bodies, a, b, places, padding) >= padding:
                continue
            for k in range(count):
                if places.sure[k] >= padding or first_pair[first + k] != NO_PAIR:
                    continue
                if _collides_at(held, bodies, pairs, p, k, places):
                    first_pair[first + k] = p
                    open_ones -= 1
            if open_ones == 0:
                break


@lean_kernel
def check_by_tree(
    held, tree, bodies, pairs, q, X_WB, first_pair, places
):  # fmt: skip
    """Write the same, of the pairs that a tree of what does not move finds.

    Where there is none the loop above is faster, as it asks nobody which pairs these are.
    """
    n = len(q)
    place_still_bodies(bodies, places)
    for a in range(len(bodies.joints)):
        places.limits[a] = pairs.most_paddings[a]
    for first in range(0, n, LANES):
        place_bodies(tree, bodies, q, first, X_WB, places)
        count = min(LANES, n - first)
        open_ones = count
        for k in range(count):
            first_pair[first + k] = NO_PAIR
        for i in range(find_near(bodies, pairs, places, 1)):
            p = places.near[i]
            a, b, padding = pairs.bodies[p, 0], pairs.bodies[p, 1], pairs.paddings[p]
            if sure_distances(bodies, a, b, places, padding) >= padding:
                continue
            for k in range(count):
                if places.sure[k] >= padding or first_pair[first + k] != NO_PAIR:
                    continue
                if _collides_at(held, bodies, pairs, p, k, places):
                    first_pair[first + k] = p
                    open_ones -= 1
            if open_ones == 0:
                break
