"""The two balls of two clouds that are nearest to each other, or deepest in each other.

Two trees are gone down at once (compare Hjaltason and Samet, *Incremental Distance Join Algorithms
for Spatial Databases*, 1998): of two nodes the larger one is opened, whose eight children are
compared with the other's box in step.
"""

import math

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.compiled.lanes import (
    bits_of,
    LANES,
    load_lanes,
    lowest_bit,
    root,
    store_lanes,
)
from scene_graph_ros.geometry.compiled.stack_arrays import stack_array
from scene_graph_ros.geometry.query.elements.covers import box_cover, from_boxes
from scene_graph_ros.geometry.query.elements.element_places import tree_of
from scene_graph_ros.geometry.query.elements.nearest import just_above, NONE
from scene_graph_ros.geometry.spatial.vectors import (
    load_rotation,
    load_translation,
    relative_pose,
    rotate,
    rotate_inverse,
    scale,
    transpose,
)

__all__ = ["find_nearest_balls", "nearest_balls"]

_STACK = 256
"""Pairs that wait: seven for each level of both trees, and one."""

_pairs = stack_array((_STACK, 4), np.int64)
_gaps = stack_array((_STACK,))
_low = stack_array((LANES,))


@inlined_kernel
def _box_of(tree, level, node):
    """Return the corners and the largest radius of a node; of the root that of all."""
    if level == len(tree.starts) - 1:
        b = tree.bounds
        return (b[0, 0], b[0, 1], b[0, 2]), (b[1, 0], b[1, 1], b[1, 2]), tree.radius[0]
    box, i = tree.boxes[tree.starts[level] + node // LANES], node % LANES
    return (box[0, i], box[1, i], box[2, i]), (box[3, i], box[4, i], box[5, i]), box[6, i]


@inlined_kernel
def _children(opened, level, node, other, level_other, node_other, R, p):
    """Return lower bounds of the distances of a node's children to another's box, in lanes.

    R and p are the pose of the other's cloud in that of the node that is opened.
    """
    lower, upper, radius = _box_of(other, level_other, node_other)
    cover = box_cover(lower, upper, R, p)
    return from_boxes(opened.boxes, opened.starts[level - 1] + node, cover) - radius


@inlined_kernel
def _push(pairs, gaps, low, bits, count, fixed, child_level, first_child, opens_A):
    """Put the children of a node that may be near enough on the stack, the nearest last."""
    begin = count
    while bits != 0:
        i = lowest_bit(bits)
        bits &= bits - 1
        k = count
        while k > begin and gaps[k - 1] < low[i]:
            gaps[k] = gaps[k - 1]
            for part in range(4):
                pairs[k, part] = pairs[k - 1, part]
            k -= 1
        gaps[k] = low[i]
        own, others = (0, 2) if opens_A else (2, 0)
        pairs[k, own], pairs[k, own + 1] = child_level, first_child + i
        pairs[k, others], pairs[k, others + 1] = fixed[0], fixed[1]
        count += 1
    return count


@inlined_kernel
def _radius(tree, leaf, i):
    return tree.radii[leaf, i] if len(tree.radii) > 0 else tree.radius[1]


@inlined_kernel
def _compare_leaves(A, B, leaf_A, leaf_B, R_BA, p_BA, best, low):
    """Return (phi, i, j) of the nearest balls of two leaves if they are nearer than ``best``."""
    at, first, second = 3 * LANES * leaf_B, NONE, NONE
    x, y = load_lanes(B.points, at), load_lanes(B.points, at + LANES)
    z = load_lanes(B.points, at + 2 * LANES)
    for i in range(LANES):
        p = (A.points[leaf_A, 0, i], A.points[leaf_A, 1, i], A.points[leaf_A, 2, i])
        q = rotate(R_BA, p)
        dx, dy, dz = (x - p_BA[0]) - q[0], (y - p_BA[1]) - q[1], (z - p_BA[2]) - q[2]
        store_lanes(low, 0, root(dx * dx + dy * dy + dz * dz))
        radius = _radius(A, leaf_A, i)
        for j in range(LANES):
            phi = low[j] - radius - _radius(B, leaf_B, j)
            if phi < best:
                best, first, second = phi, i, j
    return best, first, second


@inlined_kernel
def nearest_balls(A, B, R_AB, p_AB, max_distance):
    """Return (phi, place_A, place_B): of the nearest balls of two trees, B at a pose in A.

    Places are NONE where all are farther apart than ``max_distance``: then phi is a lower bound
    above that.
    """
    R_BA, p_BA = transpose(R_AB), scale(-1.0, rotate_inverse(R_AB, p_AB))
    pairs, gaps, low = _pairs(), _gaps(), _low()
    best, place_A, place_B, count = just_above(max_distance), NONE, NONE, 0
    if len(A.points) > 0 and len(B.points) > 0:
        pairs[0, 0], pairs[0, 1] = len(A.starts) - 1, 0
        pairs[0, 2], pairs[0, 3] = len(B.starts) - 1, 0
        gaps[0], count = -math.inf, 1
    while count > 0:
        count -= 1
        if gaps[count] >= best:
            continue
        level_A, node_A = pairs[count, 0], pairs[count, 1]
        level_B, node_B = pairs[count, 2], pairs[count, 3]
        if level_A == 0 and level_B == 0:
            phi, i, j = _compare_leaves(A, B, node_A, node_B, R_BA, p_BA, best, low)
            if i != NONE:
                best, place_A, place_B = phi, LANES * node_A + i, LANES * node_B + j
        elif level_A >= level_B:
            bounds = _children(A, level_A, node_A, B, level_B, node_B, R_AB, p_AB)
            store_lanes(low, 0, bounds)
            count = _push(
                pairs, gaps, low, bits_of(bounds < best), count, (level_B, node_B),
                level_A - 1, LANES * node_A, True,
            )  # fmt: skip
        else:
            bounds = _children(B, level_B, node_B, A, level_A, node_A, R_BA, p_BA)
            store_lanes(low, 0, bounds)
            count = _push(
                pairs, gaps, low, bits_of(bounds < best), count, (level_A, node_A),
                level_B - 1, LANES * node_B, False,
            )  # fmt: skip
    return best, place_A, place_B


@lean_kernel
def find_nearest_balls(places, first, second, X_WC, found):
    """Write (phi, place, place) of the nearest balls of two clouds, up to ``found[0]``.

    Poses are ``(k, 4, 4)``, by cloud.
    """
    R_AB, p_AB = relative_pose(
        load_rotation(X_WC, first),
        load_translation(X_WC, first),
        load_rotation(X_WC, second),
        load_translation(X_WC, second),
    )
    A, B = tree_of(places, first), tree_of(places, second)
    found[0], found[1], found[2] = nearest_balls(A, B, R_AB, p_AB, found[0])
