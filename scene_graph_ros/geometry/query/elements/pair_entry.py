"""The distance of one pair, of which clouds may be a part, in the place of PAIR_DISTANCE."""

import math

import numpy as np

from scene_graph_ros.geometry.compiled.entry_points import entry_point
from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.query.distance.pair_entry import PAIR_DISTANCE
from scene_graph_ros.geometry.query.elements.between_clouds import nearest_balls
from scene_graph_ros.geometry.query.elements.between_fields import (
    descends_first,
    nearest_voxel_to_field,
)
from scene_graph_ros.geometry.query.elements.element_places import (
    field_measure_of,
    first_element_of,
    first_field_of,
    is_of_voxels,
    measure_of,
    point_row_of,
    tree_of,
)
from scene_graph_ros.geometry.query.elements.field_entry import FIELD_DISTANCE
from scene_graph_ros.geometry.query.elements.field_to_cloud import nearest_ball_to_field
from scene_graph_ros.geometry.query.elements.nearest import nearest_element, NONE
from scene_graph_ros.geometry.spatial.vectors import (
    add,
    axpy,
    norm,
    relative_pose,
    rotate,
    scale,
    subtract,
)

__all__ = ["ELEMENT_DISTANCE"]

_IDENTITY = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
_LANES = 8
_pair_distance = PAIR_DISTANCE.call
_field_distance = FIELD_DISTANCE.call


@inlined_kernel
def _ball(tree, place):
    """Return the centre in C and the radius of the ball at a place of a tree."""
    leaf, i = place // _LANES, place % _LANES
    p = (tree.points[leaf, 0, i], tree.points[leaf, 1, i], tree.points[leaf, 2, i])
    return p, tree.radii[leaf, i] if len(tree.radii) > 0 else tree.radius[1]


@inlined_kernel
def _to_shape(places, cloud, j, R_CB, p_CB, max_distance, tolerance):
    """Return (phi, p_CCa, p_CCb, nhat_BA_C, gap) of a cloud A and the shape of row j, B."""
    phi, gap, place = nearest_element(places, cloud, j, R_CB, p_CB, max_distance, tolerance)
    if place == NONE:
        zero = (0.0, 0.0, 0.0)
        return phi, zero, zero, (0.0, 0.0, 1.0), math.inf
    p, radius = _ball(tree_of(places, cloud), place)
    point, X_CB = point_row_of(places), (R_CB, p_CB)
    arguments = places, point, j, (_IDENTITY, p), X_CB, math.inf, tolerance
    centre, _, p_CCb, nhat, own = _pair_distance(measure_of(places), arguments)
    return centre - radius, axpy(-radius, nhat, p), p_CCb, nhat, max(gap, own)


@inlined_kernel
def _to_cloud(places, cloud, other, R_AB, p_AB, max_distance):
    """Return the same of two clouds, in A."""
    A, B = tree_of(places, cloud), tree_of(places, other)
    phi, place_A, place_B = nearest_balls(A, B, R_AB, p_AB, max_distance)
    if place_A == NONE:
        zero = (0.0, 0.0, 0.0)
        return phi, zero, zero, (0.0, 0.0, 1.0), math.inf
    (p, r), (p_B, s) = _ball(A, place_A), _ball(B, place_B)
    q = add(p_AB, rotate(R_AB, p_B))
    between = subtract(p, q)
    length = norm(between)
    nhat = scale(1.0 / length, between) if length > 0.0 else (1.0, 0.0, 0.0)
    return length - r - s, axpy(-r, nhat, p), axpy(s, nhat, q), nhat, 0.0


@inlined_kernel
def _to_field(places, field, j, R_FB, p_FB, max_distance, tolerance):
    """Return the same of a field A and the shape of row j, B, in A."""
    arguments = places, field, j, (R_FB, p_FB), max_distance, tolerance
    phi, p_Fa, p_Fb, nhat, gap, _ = _field_distance(field_measure_of(places), arguments)
    return phi, p_Fa, p_Fb, nhat, gap


@inlined_kernel
def _is_last(places, i, j, first_field):
    """Return True where A is to be the second of two: elements come first, and fields of these.

    Of two fields the first is the one that is not gone down: heights, or the grid of more nodes.
    """
    if i >= first_field and j >= first_field:
        if not is_of_voxels(places, j - first_field):
            return is_of_voxels(places, i - first_field)
        if not is_of_voxels(places, i - first_field):
            return False
        return descends_first(places, i - first_field, j - first_field)
    return i < first_element_of(places) or (j >= first_field and i < first_field)


@inlined_kernel
def _to_other_field(places, field, other, R_AB, p_AB, max_distance, tolerance):
    """Return the same of two fields, of which the second is a grid of voxels."""
    if not is_of_voxels(places, other):
        return -math.inf, p_AB, p_AB, (0.0, 0.0, 1.0), math.inf
    phi, p_Fa, p_Fb, nhat, gap, _, _ = nearest_voxel_to_field(
        places, field, other, R_AB, p_AB, max_distance, tolerance
    )
    return phi, p_Fa, p_Fb, nhat, gap


def _element_distance(places, i, j, X_WA, X_WB, max_distance, tolerance):
    first, first_field = first_element_of(places), first_field_of(places)
    if i < first and j < first:
        arguments = places, i, j, X_WA, X_WB, max_distance, tolerance
        return _pair_distance(measure_of(places), arguments)
    turned = _is_last(places, i, j, first_field)
    if turned:
        i, j, X_WA, X_WB = j, i, X_WB, X_WA
    (R_WA, p_WA), (R_WB, p_WB) = X_WA, X_WB
    R_AB, p_AB = relative_pose(R_WA, p_WA, R_WB, p_WB)
    if j >= first_field:
        phi, p_ACa, p_ACb, nhat_A, gap = _to_other_field(
            places, i - first_field, j - first_field, R_AB, p_AB, max_distance, tolerance
        )
    elif i >= first_field and j < first:
        phi, p_ACa, p_ACb, nhat_A, gap = _to_field(
            places, i - first_field, j, R_AB, p_AB, max_distance, tolerance
        )
    elif i >= first_field:
        phi, p_ACa, p_ACb, nhat_A, gap, _, _ = nearest_ball_to_field(
            places, i - first_field, j - first, R_AB, p_AB, max_distance
        )
    elif j < first:
        phi, p_ACa, p_ACb, nhat_A, gap = _to_shape(
            places, i - first, j, R_AB, p_AB, max_distance, tolerance
        )
    else:
        phi, p_ACa, p_ACb, nhat_A, gap = _to_cloud(
            places, i - first, j - first, R_AB, p_AB, max_distance
        )
    p_WCa, p_WCb = add(p_WA, rotate(R_WA, p_ACa)), add(p_WA, rotate(R_WA, p_ACb))
    nhat_W = rotate(R_WA, nhat_A)
    if turned:
        return phi, p_WCb, p_WCa, scale(-1.0, nhat_W), gap
    return phi, p_WCa, p_WCb, nhat_W, gap


_POSE = 9 * (0.0,), 3 * (0.0,)

ELEMENT_DISTANCE = entry_point(
    _element_distance, (np.zeros(1, np.int64), 0, 0, _POSE, _POSE, 0.0, 0.0)
)
"""Returns what PAIR_DISTANCE does, of rows of an ElementTable, whose places it takes.

Two height fields, the only pair that has no answer, give phi = -inf: who asks refuses them."""
