"""Which configurations are free: by balls and boxes where these suffice, else exactly."""

import math

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel, merged_kernel
from scene_graph_ros.planning.pairs.bodies import (
    distance_at,
    place_bodies,
    place_static_bodies,
    sure_distances,
)
from scene_graph_ros.planning.pairs.static_kernels import find_near
from scene_graph_ros.robots.tree_kernels import LANES

__all__ = [
    "LOOSE",
    "NO_PAIR",
    "bounds_of",
    "check_by_tree",
    "check_configurations",
    "collides_at",
]

NO_PAIR = -1

LOOSE = 1e-3
"""Relative to the larger size: a first look at a distance, whose sign is certain."""


@inlined_kernel
def bounds_of(phi, gap, reach):
    """Return bounds of a distance, lower and upper; beyond ``reach`` it is a lower bound."""
    if phi > reach and gap == math.inf:
        return phi, math.inf
    return phi - gap, phi + gap


@merged_kernel
def collides_at(held, bodies, pairs, p, k, places):
    """Tell whether a pair is nearer than its padding in configuration k.

    Without padding that is a collision of ``has_collisions``. A first look decides all but pairs
    within its error of the padding.
    """
    limit, reach = pairs.paddings[p] - pairs.touching[p], max(pairs.paddings[p], 0.0)
    phi, _, _, _, gap = distance_at(held, bodies, pairs, p, k, places, reach, LOOSE)
    least, most = bounds_of(phi, gap, reach)
    if least >= limit:
        return False
    if most < limit:
        return True
    phi, _, _, _, _ = distance_at(held, bodies, pairs, p, k, places, reach, 0.0)
    return phi < limit


@merged_kernel
def _note(held, bodies, pairs, p, found, places):
    """Write a pair where it is the first that is too near; return in how many of LANES it is."""
    padding, count = pairs.paddings[p], 0
    if sure_distances(bodies, pairs.bodies[p, 0], pairs.bodies[p, 1], places, padding) >= padding:
        return 0
    for k in range(len(found)):
        if places.sure[k] >= padding or found[k] != NO_PAIR:
            continue
        if collides_at(held, bodies, pairs, p, k, places):
            found[k] = p
            count += 1
    return count


@lean_kernel
def check_configurations(held, tree, bodies, pairs, q, X_WB, first_pair, places):
    """Write the first pair that is nearer than its padding, or NO_PAIR, for each configuration."""
    place_static_bodies(bodies, places)
    for first in range(0, len(q), LANES):
        place_bodies(tree, bodies, q, first, X_WB, places)
        found = first_pair[first : first + LANES]
        found[:] = NO_PAIR
        open_ones = len(found)
        for p in range(len(pairs.bodies)):
            open_ones -= _note(held, bodies, pairs, p, found, places)
            if open_ones == 0:
                break


@lean_kernel
def check_by_tree(held, tree, bodies, pairs, q, X_WB, first_pair, places):
    """Write the same, of the pairs that a tree of static bodies finds.

    Where there is none the loop above is faster, as it asks nobody which pairs these are.
    """
    place_static_bodies(bodies, places)
    for a in range(len(bodies.joints)):
        places.limits[a] = pairs.most_paddings[a]
    for first in range(0, len(q), LANES):
        place_bodies(tree, bodies, q, first, X_WB, places)
        found = first_pair[first : first + LANES]
        found[:] = NO_PAIR
        open_ones = len(found)
        for i in range(find_near(bodies, pairs, places, 1)):
            open_ones -= _note(held, bodies, pairs, places.near[i], found, places)
            if open_ones == 0:
                break
