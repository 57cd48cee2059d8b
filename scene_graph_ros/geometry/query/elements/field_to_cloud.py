"""The ball of a cloud and the prism of a height field that are nearest to each other, or deepest.

Branch and bound in the cloud's tree: no ball of a node is nearer to the field than the node's
centre, but for half the node's diagonal and its largest radius.
"""

import math

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.compiled.lanes import LANES
from scene_graph_ros.geometry.compiled.stack_arrays import stack_array
from scene_graph_ros.geometry.query.elements.element_places import (
    field_measure_of,
    point_row_of,
    tree_of,
)
from scene_graph_ros.geometry.query.elements.field_entry import FIELD_DISTANCE
from scene_graph_ros.geometry.query.elements.nearest import just_above, NONE, push_sorted, STACK
from scene_graph_ros.geometry.spatial.vectors import (
    add,
    axpy,
    load_rotation,
    load_translation,
    relative_pose,
    rotate,
)
from scene_graph_ros.geometry.tables.point_tree import BEYOND

__all__ = ["find_ball_at_field", "nearest_ball_to_field"]

_IDENTITY = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
_ROUNDING = 1.0 + 1e-14

_nodes = stack_array((STACK, 2), np.int64)
_gaps = stack_array((STACK,))
_field_distance = FIELD_DISTANCE.call


@inlined_kernel
def _at_point(places, field, p, limit):
    """Return the answer of FIELD_DISTANCE about a point p in F."""
    arguments = places, field, point_row_of(places), (_IDENTITY, p), limit, 0.0
    return _field_distance(field_measure_of(places), arguments)


@inlined_kernel
def _expand(places, field, tree, level, node, X_FC, best, nodes, gaps, begin):
    """Put a node's children that may be nearer than ``best`` on the stack, the nearest last."""
    count, row = begin, tree.starts[level - 1] + node
    for i in range(LANES):
        box = tree.boxes[row]
        if box[0, i] >= BEYOND:
            continue
        center = (
            0.5 * (box[0, i] + box[3, i]),
            0.5 * (box[1, i] + box[4, i]),
            0.5 * (box[2, i] + box[5, i]),
        )
        x, y, z = box[3, i] - box[0, i], box[4, i] - box[1, i], box[5, i] - box[2, i]
        reach = 0.5 * _ROUNDING * math.sqrt(x * x + y * y + z * z) + box[6, i]
        p = add(rotate(X_FC[0], center), X_FC[1])
        phi, _, _, _, _, element = _at_point(places, field, p, best + reach)
        if element != NONE and phi - reach < best:
            push_sorted(nodes, gaps, count, begin, level - 1, LANES * node + i, phi - reach)
            count += 1
    return count


@inlined_kernel
def nearest_ball_to_field(places, field, cloud, R_FC, p_FC, max_distance):
    """Return (phi, p_Fa, p_Fb, nhat_BA_F, gap, element, place) of a field F, A, and a cloud, B.

    ``place`` is where the ball is in the tree's order; it and ``element`` are NONE where all are
    farther than ``max_distance``: then phi is a lower bound above that.
    """
    tree, zero = tree_of(places, cloud), (0.0, 0.0, 0.0)
    nodes, gaps = _nodes(), _gaps()
    best, element, place, own = just_above(max_distance), NONE, NONE, math.inf
    p_Fa, p_Fb, nhat = zero, zero, (0.0, 0.0, 1.0)
    nodes[0, 0], nodes[0, 1], gaps[0] = len(tree.starts) - 1, 0, -math.inf
    count = 1 if len(tree.points) > 0 else 0
    while count > 0:
        count -= 1
        level, node = nodes[count, 0], nodes[count, 1]
        if gaps[count] >= best:
            continue
        if level > 0:
            count = _expand(
                places, field, tree, level, node, (R_FC, p_FC), best, nodes, gaps, count
            )
            continue
        for i in range(LANES):
            radius = tree.radii[node, i] if len(tree.radii) > 0 else tree.radius[1]
            p_C = (tree.points[node, 0, i], tree.points[node, 1, i], tree.points[node, 2, i])
            p = add(rotate(R_FC, p_C), p_FC)
            phi, a, b, n, gap, prism = _at_point(places, field, p, best + radius)
            if prism != NONE and phi - radius < best:
                best, element, place, own = phi - radius, prism, LANES * node + i, gap
                p_Fa, p_Fb, nhat = a, axpy(radius, n, b), n
    return best, p_Fa, p_Fb, nhat, own, element, place


@lean_kernel
def find_ball_at_field(places, field, cloud, X_WF, X_WC, max_distance, found):
    """Write (phi, place, element) of the nearest ball and prism, poses ``(1, 4, 4)``."""
    R_FC, p_FC = relative_pose(
        load_rotation(X_WF, 0),
        load_translation(X_WF, 0),
        load_rotation(X_WC, 0),
        load_translation(X_WC, 0),
    )
    phi, _, _, _, _, element, place = nearest_ball_to_field(
        places, field, cloud, R_FC, p_FC, max_distance
    )
    found[0], found[1], found[2] = phi, place, element
