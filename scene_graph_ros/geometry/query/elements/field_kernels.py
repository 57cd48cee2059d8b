"""Kernels that Python asks about height fields: prisms near rows, and near points."""

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import lean_kernel
from scene_graph_ros.geometry.query.elements.element_places import (
    field_measure_of,
    grid_of,
    point_row_of,
    prism_row_of,
)
from scene_graph_ros.geometry.query.elements.field_entry import FIELD_DISTANCE
from scene_graph_ros.geometry.query.elements.nearest import NONE
from scene_graph_ros.geometry.query.point.point_convex import point_convex
from scene_graph_ros.geometry.spatial.vectors import (
    add,
    load_rotation,
    load_translation,
    load_vector,
    relative_pose,
    rotate,
    rotate_inverse,
    store_vector,
    subtract,
)
from scene_graph_ros.geometry.tables.held_table import borrowed_table
from scene_graph_ros.geometry.tables.prism_slots import prism_origin, write_prism

__all__ = ["find_prisms", "find_prisms_at_points", "place_prisms"]

_IDENTITY = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
_field_distance = FIELD_DISTANCE.call


@lean_kernel
def find_prisms(places, field, X_WG, X_WF, rows, max_distance, found):
    """Write (phi, element) of the prism of a field nearest to each of some rows, ``(k, 2)``.

    Poses are ``(n, 4, 4)`` and ``(1, 4, 4)``.
    """
    R_WF, p_WF = load_rotation(X_WF, 0), load_translation(X_WF, 0)
    for k in range(len(rows)):
        j = rows[k]
        X_FB = relative_pose(R_WF, p_WF, load_rotation(X_WG, j), load_translation(X_WG, j))
        arguments = places, field, j, X_FB, max_distance, 0.0
        phi, _, _, _, _, element = _field_distance(field_measure_of(places), arguments)
        found[k, 0], found[k, 1] = phi, element


@lean_kernel
def find_prisms_at_points(places, field, X_WF, p_WQs, threshold, columns, elements):
    """Write the answers to points about a field; elements are NONE beyond the threshold."""
    table, grid, point = borrowed_table(places), grid_of(places, field), point_row_of(places)
    R_WF, p_WF = load_rotation(X_WF, 0), load_translation(X_WF, 0)
    phis, p_GNs, grads, are_unique = columns
    row = prism_row_of(places)
    for k in range(len(p_WQs)):
        q = rotate_inverse(R_WF, subtract(load_vector(p_WQs, k), p_WF))
        arguments = places, field, point, (_IDENTITY, q), threshold, 0.0
        _, _, _, _, _, element = _field_distance(field_measure_of(places), arguments)
        elements[k] = NONE
        if element == NONE:
            continue
        write_prism(table, row, grid, element)
        origin = prism_origin(grid, element)
        hulls, hull = table.hulls, table.hull[row]
        phi, nearest, gradient, unique = point_convex(
            hulls, hull, table.scale[row], subtract(q, origin)
        )
        if phi > threshold:
            continue
        elements[k] = element
        phis[k], are_unique[k] = phi, unique
        store_vector(p_GNs, k, add(origin, nearest))
        store_vector(grads, k, rotate(R_WF, gradient))


@lean_kernel
def place_prisms(places, fields, elements, rows, p_FP):
    """Make rows that are ours prisms of fields; write where their origins are ``(k, 3)``."""
    table = borrowed_table(places)
    for k in range(len(rows)):
        grid = grid_of(places, np.int64(fields[k]))
        write_prism(table, rows[k], grid, elements[k])
        store_vector(p_FP, k, prism_origin(grid, elements[k]))
