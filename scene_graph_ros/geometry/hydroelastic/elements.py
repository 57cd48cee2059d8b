"""Kernels over the elements of one body: fields of tetrahedra, normals of triangles, boxes."""

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import kernel
from scene_graph_ros.geometry.spatial.vectors import (
    cross,
    dot,
    load_vector,
    store_vector,
    subtract,
    unit,
)

__all__ = ["element_boxes", "linear_fields", "triangle_normals"]


@kernel
def _by_pressure(pressure, corners, order):
    """Write the four corners to ``order`` with their pressures ascending, equal ones as given."""
    for k in range(4):
        corner = corners[k]
        at = k
        while at > 0 and pressure[order[at - 1]] > pressure[corner]:
            order[at] = order[at - 1]
            at -= 1
        order[at] = corner


@kernel
def linear_fields(vertices, tetrahedra, pressure):
    """Find the linear field of each tetrahedron that takes the pressures at its corners.

    The gradient g solves ``g . e_k = p_k+1 - p_k`` for the three edges of a path through the
    corners with ascending pressure. Then corners of equal pressure are joined by edges of their
    own, and the gradient of a tetrahedron that is thin between them keeps its digits.

    Args:
        vertices: (v, 3) metres.
        tetrahedra: (t, 4) with volumes that are not 0.
        pressure: (v,) Pa.

    Returns:
        gradient (t, 3) Pa/m and constant (t,) Pa: ``p(x) = gradient . x + constant``.

    """
    gradient = np.empty((len(tetrahedra), 3))
    constant = np.empty(len(tetrahedra))
    order = np.empty(4, np.int64)
    for t in range(len(tetrahedra)):
        _by_pressure(pressure, tetrahedra[t], order)
        x0, x1 = load_vector(vertices, order[0]), load_vector(vertices, order[1])
        x2, x3 = load_vector(vertices, order[2]), load_vector(vertices, order[3])
        e1, e2, e3 = subtract(x1, x0), subtract(x2, x1), subtract(x3, x2)
        n1, n2, n3 = cross(e2, e3), cross(e3, e1), cross(e1, e2)
        s1 = pressure[order[1]] - pressure[order[0]]
        s2 = pressure[order[2]] - pressure[order[1]]
        s3 = pressure[order[3]] - pressure[order[2]]
        det = dot(e1, n1)
        g = (
            (s1 * n1[0] + s2 * n2[0] + s3 * n3[0]) / det,
            (s1 * n1[1] + s2 * n2[1] + s3 * n3[1]) / det,
            (s1 * n1[2] + s2 * n2[2] + s3 * n3[2]) / det,
        )
        store_vector(gradient, t, g)
        constant[t] = pressure[order[0]] - dot(g, x0)
    return gradient, constant


@kernel
def triangle_normals(vertices, triangles):
    """Return (t, 3) unit normals, outward for triangles counter-clockwise from outside."""
    normals = np.empty((len(triangles), 3))
    for t in range(len(triangles)):
        a = load_vector(vertices, triangles[t, 0])
        b = load_vector(vertices, triangles[t, 1])
        c = load_vector(vertices, triangles[t, 2])
        normal = cross(subtract(b, a), subtract(c, a))
        store_vector(normals, t, unit(normal, (0.0, 0.0, 0.0)))
    return normals


@kernel
def element_boxes(vertices, elements, width):
    """Return (t, 3) lower and upper corners of the boxes of the elements' first corners."""
    lower = np.empty((len(elements), 3))
    upper = np.empty((len(elements), 3))
    for t in range(len(elements)):
        for axis in range(3):
            low = high = vertices[elements[t, 0], axis]
            for k in range(1, width):
                value = vertices[elements[t, k], axis]
                low, high = min(low, value), max(high, value)
            lower[t, axis] = low
            upper[t, axis] = high
    return lower, upper
