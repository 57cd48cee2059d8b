"""The ball of a cloud that is nearest to a point, or deepest around it."""

import math

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.compiled.lanes import (
    bits_of,
    LANES,
    larger,
    load_lanes,
    lowest_bit,
    root,
    store_lanes,
)
from scene_graph_ros.geometry.compiled.stack_arrays import stack_array
from scene_graph_ros.geometry.query.elements.nearest import just_above, NONE, push_sorted, STACK
from scene_graph_ros.geometry.query.point.point_sphere import point_sphere
from scene_graph_ros.geometry.spatial.vectors import (
    add,
    load_rotation,
    load_translation,
    load_vector,
    rotate,
    rotate_inverse,
    store_vector,
    subtract,
)
from scene_graph_ros.geometry.tables.point_tree import borrowed_points, BOX

__all__ = ["find_balls"]

_ROUNDING = 1.0 - 1e-15
"""Times the distance to a box: rounding never makes it more than the truth."""

_nodes = stack_array((STACK, 2), np.int64)
_gaps = stack_array((STACK,))
_low = stack_array((LANES,))


@inlined_kernel
def _to_boxes(boxes, row, q):
    """Return lower bounds of a point's distances to balls below a node's children, in lanes."""
    at = row * BOX * LANES
    x = larger(load_lanes(boxes, at) - q[0], q[0] - load_lanes(boxes, at + 3 * LANES))
    y = larger(load_lanes(boxes, at + LANES) - q[1], q[1] - load_lanes(boxes, at + 4 * LANES))
    z = larger(load_lanes(boxes, at + 2 * LANES) - q[2], q[2] - load_lanes(boxes, at + 5 * LANES))
    x, y, z = larger(x, 0.0), larger(y, 0.0), larger(z, 0.0)
    return root(x * x + y * y + z * z) * _ROUNDING - load_lanes(boxes, at + 6 * LANES)


@inlined_kernel
def _to_points(tree, leaf, q):
    """Return the signed distances of a point to a leaf's balls, in lanes."""
    at = leaf * 3 * LANES
    x = load_lanes(tree.points, at) - q[0]
    y = load_lanes(tree.points, at + LANES) - q[1]
    z = load_lanes(tree.points, at + 2 * LANES) - q[2]
    distance = root(x * x + y * y + z * z)
    if len(tree.radii) > 0:
        return distance - load_lanes(tree.radii, leaf * LANES)
    return distance - tree.radius[1]


@inlined_kernel
def _nearest_ball(tree, q, threshold, nodes, gaps, low):
    """Return (place, leaf, lane) of the ball nearest to a point in C; NONE beyond a threshold."""
    best, place, count = just_above(threshold), NONE, 0
    if len(tree.points) > 0:
        nodes[0, 0], nodes[0, 1], gaps[0], count = len(tree.starts) - 1, 0, -math.inf, 1
    while count > 0:
        count -= 1
        level, node = nodes[count, 0], nodes[count, 1]
        if gaps[count] >= best:
            continue
        if level == 0:
            bounds = _to_points(tree, node, q)
            store_lanes(low, 0, bounds)
            for i in range(LANES):
                if low[i] < best:
                    best, place = low[i], LANES * node + i
            continue
        bounds = _to_boxes(tree.boxes, tree.starts[level - 1] + node, q)
        store_lanes(low, 0, bounds)
        bits, begin = bits_of(bounds < best), count
        while bits != 0:
            i = lowest_bit(bits)
            bits &= bits - 1
            push_sorted(nodes, gaps, count, begin, level - 1, LANES * node + i, low[i])
            count += 1
    return place


@lean_kernel
def find_balls(places, X_WC, p_WQs, threshold, columns, elements):
    """Write the answers to points about a cloud; elements are NONE beyond the threshold."""
    tree = borrowed_points(places)
    R_WC, p_WC = load_rotation(X_WC, 0), load_translation(X_WC, 0)
    nodes, gaps, low = _nodes(), _gaps(), _low()
    phis, p_GNs, grads, are_unique = columns
    for k in range(len(p_WQs)):
        q = rotate_inverse(R_WC, subtract(load_vector(p_WQs, k), p_WC))
        place = _nearest_ball(tree, q, threshold, nodes, gaps, low)
        elements[k] = NONE
        if place == NONE:
            continue
        leaf, i = place // LANES, place % LANES
        p = (tree.points[leaf, 0, i], tree.points[leaf, 1, i], tree.points[leaf, 2, i])
        radius = tree.radii[leaf, i] if len(tree.radii) > 0 else tree.radius[1]
        phi, nearest, gradient, unique = point_sphere((radius, 0.0, 0.0), subtract(q, p))
        if phi > threshold:
            continue
        elements[k] = tree.order[place]
        phis[k], are_unique[k] = phi, unique
        store_vector(p_GNs, k, add(p, nearest))
        store_vector(grads, k, rotate(R_WC, gradient))
