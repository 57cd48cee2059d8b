"""Which pairs may be nearer than some distance in any of eight configurations, by a tree."""

import math

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, merged_kernel
from scene_graph_ros.geometry.compiled.lanes import LANES, load_lanes, smaller
from scene_graph_ros.geometry.tables.vertex_scan import half_ahead, quarter_ahead

__all__ = ["WORD", "find_near", "least_of"]

WORD = 8
"""Marks, each a byte, that are looked at as one number."""

_MARGIN = 1.0 + 1e-12
"""Times squared distances: far more than rounding adds."""


@inlined_kernel
def least_of(lanes):
    """Return the least number of lanes."""
    lanes = smaller(lanes, half_ahead(lanes))
    lanes = smaller(lanes, quarter_ahead(lanes))
    return min(lanes[0], lanes[1])


@inlined_kernel
def _square_from(center, x, y, z):
    """Return squared lower bounds of a point's distance to a body's centre, in LANES."""
    dx, dy, dz = (
        load_lanes(center, 0) - x,
        load_lanes(center, LANES) - y,
        load_lanes(center, 2 * LANES) - z,
    )
    return least_of(dx * dx + dy * dy + dz * dz)


@inlined_kernel
def _mark_near(nodes, of_still, center, reach, marks):
    """Mark a body's pairs that may be near; return a lower bound of all others' excess.

    ``reach`` (m) is the radius of the body and the distance that counts.
    """
    slack, i = math.inf, 0
    while i < len(nodes.radii):
        square = _square_from(
            center, nodes.centers[i, 0], nodes.centers[i, 1], nodes.centers[i, 2]
        )
        far = reach + nodes.radii[i]
        if far < 0.0 or square > far * far * _MARGIN:
            slack = min(slack, math.sqrt(square) - far)
            i = nodes.skips[i]
        else:
            b = nodes.bodies[i]
            if b >= 0 and of_still[b] >= 0:
                marks[of_still[b]] = 1
            i += 1
    return slack


@merged_kernel
def find_near(bodies, pairs, places, fewest):
    """Write to ``places.near`` the pairs that may be nearer than the bound; return their number.

    That is ``places.limits`` (m) of each body of a robot. In ascending order. ``places.slacks``
    says how much farther away all others of each are at least. Of a tree of fewer nodes than
    ``fewest``, and without one, that is all pairs.
    """
    nodes, near, marks, words = bodies.nodes, places.near, places.marks, places.words
    if len(nodes.radii) < fewest:
        return len(pairs.bodies)
    for i in range(len(pairs.others)):
        marks[pairs.others[i]] = 1
    for a in range(len(bodies.joints)):
        reach = bodies.radii[a] + places.limits[a]
        places.slacks[a] = _mark_near(nodes, pairs.of_still[a], places.centers[a], reach, marks)
    count = 0
    for w in range(len(words)):
        if words[w] != 0:
            for p in range(WORD * w, WORD * w + WORD):
                if marks[p] != 0:
                    near[count] = p
                    count += 1
            words[w] = 0
    return count
