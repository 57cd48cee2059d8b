"""The element of a cloud that is nearest to a shape, or deepest in it.

Branch and bound in the tree of points (compare Roussopoulos and others, *Nearest Neighbor
Queries*, 1995): a node is left out where its box is farther from the shape's than one that was
found. Of a point
that may be nearer PAIR_DISTANCE tells the distance, as of a sphere without a radius, so that the
answer is as exact as that. Where boxes tell little, as for many points in little space, the
distance of a node's centre does: no point of the node is nearer by more than its half diagonal.
"""

import math

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.compiled.lanes import (
    bits_of,
    LANES,
    load_lanes,
    lowest_bit,
    select,
    store_lanes,
)
from scene_graph_ros.geometry.compiled.stack_arrays import stack_array
from scene_graph_ros.geometry.query.distance.pair_entry import PAIR_DISTANCE
from scene_graph_ros.geometry.query.elements.covers import cover_of, from_boxes, from_points
from scene_graph_ros.geometry.query.elements.element_places import (
    measure_of,
    point_row_of,
    tree_of,
)
from scene_graph_ros.geometry.spatial.vectors import (
    load_rotation,
    load_translation,
    relative_pose,
)
from scene_graph_ros.geometry.tables.held_table import borrowed_table

__all__ = ["NONE", "STACK", "find_nearest", "just_above", "nearest_element", "push_sorted"]

NONE = -1
"""Instead of a place in the tree: no element is near enough."""

STACK = 128
"""Nodes and points that wait: seven for each level, and one; a tree has at most ten levels."""

_ENOUGH = 16
"""Distances measured before those of nodes' centres are, too."""

_IDENTITY = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)

_nodes = stack_array((STACK, 2), np.int64)
_gaps = stack_array((STACK,))
_low = stack_array((LANES,))
_known = stack_array((5,))
_pair_distance = PAIR_DISTANCE.call


@inlined_kernel
def just_above(limit):
    """Return a number above a limit by rounding, so that elements as near as that are found."""
    return limit + (4e-16 * abs(limit) + 5e-324)


@inlined_kernel
def least_of_eight(numbers):
    """Return the least of lanes that were stored."""
    a, b = min(numbers[0], numbers[1]), min(numbers[2], numbers[3])
    c, d = min(numbers[4], numbers[5]), min(numbers[6], numbers[7])
    return min(min(a, b), min(c, d))


@inlined_kernel
def push_sorted(nodes, gaps, count, begin, level, node, gap):
    """Put a node among those pushed since ``begin``, of which the nearest comes last."""
    k = count
    while k > begin and gaps[k - 1] < gap:
        gaps[k], nodes[k, 0], nodes[k, 1] = gaps[k - 1], nodes[k - 1, 0], nodes[k - 1, 1]
        k -= 1
    gaps[k], nodes[k, 0], nodes[k, 1] = gap, level, node


@inlined_kernel
def _point_distance(places, j, point, p, X_CB, limit, tolerance):
    """Return the answer of PAIR_DISTANCE to a point p in C and the shape of row j."""
    arguments = places, point, j, (_IDENTITY, p), X_CB, max(limit, 0.0), tolerance
    return _pair_distance(measure_of(places), arguments)


@inlined_kernel
def _from_center(places, j, point, tree, level, node, X_CB, best, tolerance):
    """Return a lower bound of the distances of balls below a node, by its box's centre."""
    box, i = tree.boxes[tree.starts[level] + node // LANES], node % LANES
    p = (
        0.5 * (box[0, i] + box[3, i]),
        0.5 * (box[1, i] + box[4, i]),
        0.5 * (box[2, i] + box[5, i]),
    )
    x, y, z = box[3, i] - box[0, i], box[4, i] - box[1, i], box[5, i] - box[2, i]
    reach = 0.5 * (1.0 + 1e-14) * math.sqrt(x * x + y * y + z * z) + box[6, i]
    phi, _, _, _, gap = _point_distance(places, j, point, p, X_CB, best + reach, tolerance)
    if phi == math.inf or gap == math.inf:
        return max(best, phi - reach) if phi < math.inf else best
    return phi - gap - reach


@inlined_kernel
def _radius(tree, leaf, i):
    return tree.radii[leaf, i] if len(tree.radii) > 0 else tree.radius[1]


@inlined_kernel
def _expand(tree, level, node, cover, best, nodes, gaps, low, begin):
    """Put a node's children, or a leaf's points, that may be nearer than ``best`` on the stack.

    Returns (count, beyond): how long that is, and how near those are at least that are left out.
    """
    if level > 0:
        bounds = from_boxes(tree.boxes, tree.starts[level - 1] + node, cover)
    else:
        bounds = from_points(tree.points, node, cover)
        if len(tree.radii) > 0:
            bounds = bounds - load_lanes(tree.radii, node * LANES)
        else:
            bounds = bounds - tree.radius[1]
    is_open = bounds < best
    store_lanes(low, 0, select(is_open, math.inf, bounds))
    beyond = least_of_eight(low)
    store_lanes(low, 0, bounds)
    bits, count = bits_of(is_open), begin
    while bits != 0:
        i = lowest_bit(bits)
        bits &= bits - 1
        push_sorted(nodes, gaps, count, begin, level - 1, LANES * node + i, low[i])
        count += 1
    return count, beyond


@inlined_kernel
def _measure(places, j, point, tree, at, X_CB, best, tolerance, known):
    """Return (phi, gap, looks) of the ball at a place of the tree; phi is ``best`` for a bound.

    ``known`` has the point that was measured last, its distance and its gap: many points may be
    one. ``looks`` is 1 where it was measured now.
    """
    leaf, i, looks = at // LANES, at % LANES, 0
    radius = _radius(tree, leaf, i)
    x, y, z = tree.points[leaf, 0, i], tree.points[leaf, 1, i], tree.points[leaf, 2, i]
    if not (x == known[0] and y == known[1] and z == known[2]):
        known[3], _, _, _, known[4] = _point_distance(
            places, j, point, (x, y, z), X_CB, best + radius, tolerance
        )
        known[0], known[1], known[2], looks = x, y, z, 1
    phi, gap = known[3] - radius, known[4]
    if phi == math.inf or gap == math.inf:
        known[0] = math.nan  # a bound is that of one radius
        return max(best, phi) if phi < math.inf else best, 0.0, looks
    return phi, gap, looks


@inlined_kernel
def nearest_element(places, cloud, j, R_CB, p_CB, max_distance, tolerance):
    """Return (phi, gap, place): the signed distance of a cloud C to row j, B.

    ``place`` is where in the tree's order the nearest ball is, or NONE where all are farther than
    ``max_distance``: then phi is a lower bound above that. ``gap`` bounds by how much phi may be
    too large, infinite for a bound.
    """
    table, tree = borrowed_table(places), tree_of(places, cloud)
    point, X_CB, top = point_row_of(places), (R_CB, p_CB), len(tree.starts) - 1
    cover, is_convex = cover_of(table, j, R_CB, p_CB), not table.exact[j]
    nodes, gaps, low, known = _nodes(), _gaps(), _low(), _known()
    best, place, least, beyond = just_above(max_distance), NONE, math.inf, math.inf
    nodes[0, 0], nodes[0, 1], gaps[0], known[0], looks = top, 0, -math.inf, math.nan, 0
    count = 1 if len(tree.points) > 0 else 0
    while count > 0:
        count -= 1
        level, node, gap = nodes[count, 0], nodes[count, 1], gaps[count]
        if gap < best and looks > _ENOUGH and is_convex and 0 <= level < top:
            gap = _from_center(places, j, point, tree, level, node, X_CB, best, tolerance)
        if gap >= best:
            beyond = min(beyond, gap)
        elif level >= 0:
            count, left_out = _expand(tree, level, node, cover, best, nodes, gaps, low, count)
            beyond = min(beyond, left_out)
        else:
            phi, gap, look = _measure(places, j, point, tree, node, X_CB, best, tolerance, known)
            looks += look
            if phi < best:
                best, place, least = phi, node, min(least, phi - gap)
            else:
                beyond = min(beyond, phi)
    if place == NONE:
        return max(beyond, just_above(max_distance)), math.inf, NONE
    return best, max(best - least, 0.0), place


@lean_kernel
def find_nearest(places, cloud, X_WG, X_WC, rows, max_distance, found):
    """Write (phi, place) of the ball of a cloud that is nearest to each of some rows, ``(k, 2)``.

    Poses are ``(n, 4, 4)`` and ``(1, 4, 4)``.
    """
    R_WC, p_WC = load_rotation(X_WC, 0), load_translation(X_WC, 0)
    for k in range(len(rows)):
        j = rows[k]
        R_WB, p_WB = load_rotation(X_WG, j), load_translation(X_WG, j)
        R_CB, p_CB = relative_pose(R_WC, p_WC, R_WB, p_WB)
        phi, _, place = nearest_element(places, cloud, j, R_CB, p_CB, max_distance, 0.0)
        found[k, 0], found[k, 1] = phi, place
