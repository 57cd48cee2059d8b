"""The elements of all bodies as the contact kernels read them: packed, in the order of leaves."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.hydroelastic.body_table import BodyTable

__all__ = ["ElementTable", "build_element_table"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


class ElementTable(NamedTuple):
    """A ``BodyTable``, laid out for the kernels. All in the frames of the geometries, SI units.

    The elements of a body stand in the order of the leaves of its tree, and each row has all that
    is known of an element, so that nothing is looked up through indices.
    """

    kind: NDArray[np.int32]
    """(n,) BodyKind of each row of the proximity arrays."""
    body: IntArray
    """(n,) index of the body, -1 without one."""
    margin: FloatArray
    """(n,) metres."""
    reach: FloatArray
    """(b,) metres: the largest magnitude of a coordinate of a body's box, which decides rounding;
    0 for half spaces."""
    element_start: IntArray
    """(b + 1,)."""
    elements: FloatArray
    """(E, 20): the x, y and z of a tetrahedron's four corners, their pressures, its pressure's
    gradient and constant; the same of a triangle's three corners and once more the first, then
    at 16 its unit normal; a half space's gradient at 16 and its constant."""
    gradients: FloatArray
    """(E, 3): of the elements' pressure, 0 for triangles."""
    planes: FloatArray
    """(E, 16): for tetrahedra the x, y and z of four unit normals inwards, and four offsets; the
    same for triangles of planes through their three sides and, last, 0."""
    boxes: FloatArray
    """(E, 6): centre and half extents of each element."""
    node_start: IntArray
    """(b + 1,)."""
    node_boxes: FloatArray
    """(N, 6): centre and half extents."""
    node_left: IntArray
    """(N,) row of a child, or ``-1 - first element``."""
    node_right: IntArray
    """(N,) row of a child, or the number of elements."""


def build_element_table(table: BodyTable) -> ElementTable:
    """Lay a ``BodyTable`` out for the kernels."""
    starts, nodes = table.element_start, table.node_start
    body_of_node = np.repeat(np.arange(len(nodes) - 1), np.diff(nodes))
    has_tree = np.diff(nodes) > 0
    body_of_element = np.repeat(np.arange(len(starts) - 1), np.diff(starts))
    # Bodies without a tree, half spaces, have no order.
    rows = np.arange(len(table.elements))
    with_tree = has_tree[body_of_element]
    rows[with_tree] = (table.order + starts[body_of_element])[with_tree]
    corners_of = table.elements[rows]
    elements = np.zeros((len(rows), 20))
    is_tetrahedron = corners_of[:, 3] >= 0
    is_triangle = ~is_tetrahedron & (corners_of[:, 0] >= 0)
    tetrahedra = table.vertices[corners_of[is_tetrahedron]]
    triangles = table.vertices[corners_of[is_triangle][:, [0, 1, 2, 0]]]
    elements[is_tetrahedron, :12] = tetrahedra.transpose(0, 2, 1).reshape(-1, 12)
    elements[is_tetrahedron, 12:16] = table.pressure[corners_of[is_tetrahedron]]
    elements[is_triangle, :12] = triangles.transpose(0, 2, 1).reshape(-1, 12)
    elements[:, 16:19] = table.gradient_G[rows]
    elements[:, 19] = table.constant[rows]
    elements[is_triangle, 16:19] = table.normals[rows][is_triangle]
    planes = np.zeros((len(rows), 16))
    planes[is_tetrahedron] = _planes(tetrahedra)
    planes[is_triangle] = _side_planes(triangles, elements[is_triangle, 16:19])
    boxes = np.zeros((len(rows), 6))
    for which, corners in ((is_tetrahedron, tetrahedra), (is_triangle, triangles)):
        boxes[which] = _centred(corners.min(axis=1), corners.max(axis=1))
    leaf = table.node_left < 0
    first = np.where(leaf, -starts[body_of_node], nodes[body_of_node])
    reach = np.zeros(len(nodes) - 1)
    np.maximum.at(reach, body_of_node, np.abs(table.node_lower).max(axis=1, initial=0.0))
    np.maximum.at(reach, body_of_node, np.abs(table.node_upper).max(axis=1, initial=0.0))
    return ElementTable(
        kind=table.kind,
        body=table.body,
        margin=table.margin,
        reach=reach,
        element_start=starts,
        elements=elements,
        gradients=np.ascontiguousarray(table.gradient_G[rows]),
        planes=planes,
        boxes=boxes,
        node_start=nodes,
        node_boxes=_centred(table.node_lower, table.node_upper),
        node_left=table.node_left + first,
        node_right=np.where(leaf, table.node_right, table.node_right + nodes[body_of_node]),
    )


def _centred(lower: FloatArray, upper: FloatArray) -> FloatArray:
    """Return (n, 6) centres and half extents of boxes."""
    return np.concatenate([0.5 * (lower + upper), 0.5 * (upper - lower)], axis=1)


def _planes(corners: FloatArray) -> FloatArray:
    """Return (n, 16) planes of the faces opposite to each corner of (n, 4, 3) tetrahedra."""
    planes = np.empty((len(corners), 4, 4))
    for k in range(4):
        # The same three corners in the same order for both neighbours at a face, up to a
        # rotation: the offset is taken at their centroid.
        others = [i for i in range(4) if i != k]
        a, b, c = (corners[:, i] for i in others)
        normals = np.cross(b - a, c - a)
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        inside = np.einsum("ij,ij->i", normals, corners[:, k] - a)
        normals *= np.where(inside < 0.0, -1.0, 1.0)[:, None]
        planes[:, k, :3] = normals
        planes[:, k, 3] = -np.einsum("ij,ij->i", normals, (a + b + c) / 3.0)
    return planes.transpose(0, 2, 1).reshape(-1, 16)


def _side_planes(corners: FloatArray, normals: FloatArray) -> FloatArray:
    """Return (n, 16) planes through the sides of (n, 4, 3) triangles, upright on them."""
    planes = np.zeros((len(corners), 4, 4))
    for k in range(3):
        a, b = corners[:, k], corners[:, k + 1]
        inward = np.cross(normals, b - a)
        lengths = np.linalg.norm(inward, axis=1, keepdims=True)
        np.divide(inward, lengths, out=inward, where=lengths > 0.0)  # a flat one has no normal
        planes[:, k, :3] = inward
        planes[:, k, 3] = -np.einsum("ij,ij->i", inward, 0.5 * (a + b))
    return planes.transpose(0, 2, 1).reshape(-1, 16)
