"""The voxel of a grid that is nearest to points, or deepest around them."""

from scene_graph_ros.geometry.compiled.kernel import lean_kernel
from scene_graph_ros.geometry.query.elements.element_places import (
    field_measure_of,
    point_row_of,
    voxels_of,
)
from scene_graph_ros.geometry.query.elements.field_entry import FIELD_DISTANCE
from scene_graph_ros.geometry.query.elements.nearest import NONE
from scene_graph_ros.geometry.query.elements.voxel_search import voxel_center
from scene_graph_ros.geometry.query.point.point_box import point_box
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

__all__ = ["find_voxels_at_points"]

_IDENTITY = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
_field_distance = FIELD_DISTANCE.call


@lean_kernel
def find_voxels_at_points(places, field, X_WF, p_WQs, threshold, columns, elements):
    """Write the answers to points about a grid; elements are NONE beyond the threshold."""
    bits, point = voxels_of(places, field), point_row_of(places)
    R_WF, p_WF = load_rotation(X_WF, 0), load_translation(X_WF, 0)
    phis, p_GNs, grads, are_unique = columns
    for k in range(len(p_WQs)):
        q = rotate_inverse(R_WF, subtract(load_vector(p_WQs, k), p_WF))
        arguments = places, field, point, (_IDENTITY, q), threshold, 0.0
        _, _, _, _, _, element = _field_distance(field_measure_of(places), arguments)
        elements[k] = NONE
        if element == NONE:
            continue
        center, half = voxel_center(bits, element)
        phi, nearest, gradient, unique = point_box((half, half, half), subtract(q, center))
        if phi > threshold:
            continue
        elements[k] = element
        phis[k], are_unique[k] = phi, unique
        store_vector(p_GNs, k, add(center, nearest))
        store_vector(grads, k, rotate(R_WF, gradient))
