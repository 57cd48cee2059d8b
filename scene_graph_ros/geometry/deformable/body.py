"""Deformable geometries as the contact kernels read them.

A ``Body`` belongs to a reference mesh and is built once: its tetrahedra, the field of
``field.py`` and the topology of a bounding volume hierarchy. A ``DeformedBody`` belongs to a
configuration: the boxes of the same hierarchy are fitted anew, which costs as much as looking at
each tetrahedron once.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.kernel import kernel, lean_kernel
from scene_graph_ros.geometry.deformable.field import reference_field
from scene_graph_ros.geometry.meshes.bvh import build_bvh
from scene_graph_ros.geometry.meshes.cache import BuildCache
from scene_graph_ros.geometry.meshes.volume_mesh import VolumeMesh
from scene_graph_ros.geometry.model.deformable import Configuration, Deformable
from scene_graph_ros.geometry.model.derived import derived_of_constant
from scene_graph_ros.geometry.spatial.vectors import (
    axpy,
    cross,
    dot,
    load_vector,
    norm,
    scale,
    store_vector,
    subtract,
)
from scene_graph_ros.geometry.tolerances import FLAT_TETRAHEDRON

__all__ = ["Body", "DeformedBody", "body_of", "deformed_body"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


class Body(NamedTuple):
    """The data that no configuration changes."""

    tetrahedra: IntArray
    """(t, 4)."""
    field: FloatArray
    """(v,) metres: the approximate signed distance at each vertex, at most 0."""
    left: IntArray
    """(n,) row of a node's left child, or ``-1 - slot`` at a leaf; see ``meshes.bvh``."""
    right: IntArray
    """(n,) row of the right child, or the number of tetrahedra at a leaf."""
    order: IntArray
    """(t,) rows of the tetrahedra in the order of the leaves."""


class DeformedBody(NamedTuple):
    """A body in one configuration, around an origin of its own, with the axes of W."""

    origin: FloatArray
    """(3,) metres in W: the centre of the box around the body."""
    reach: float
    """Metres: the largest magnitude of a coordinate about the origin."""
    vertices: FloatArray
    """(v, 3) metres from the origin."""
    is_solid: NDArray[np.bool_]
    """(t,) whether a tetrahedron is neither flat nor turned inside out."""
    gradients: FloatArray
    """(t, 3) the gradient of the field in W, 0 where the tetrahedron is not solid."""
    element_boxes: FloatArray
    """(t, 6) centre and half extents of each tetrahedron's box."""
    boxes: FloatArray
    """(n, 6) the same of each node of the hierarchy."""


_CAPACITY = 64
_bodies: BuildCache[Body] = BuildCache(_CAPACITY)


@derived_of_constant
def body_of(deformable: Deformable) -> Body:
    """Return the data that no configuration changes, built on first use; equal meshes share it."""
    return _bodies.get(deformable.mesh, lambda: _build(deformable.mesh))


def _build(mesh: VolumeMesh) -> Body:
    corners = mesh.vertices[mesh.tetrahedra]
    _, _, left, right, order = build_bvh(corners.min(axis=1), corners.max(axis=1))
    return Body(mesh.tetrahedra.copy(), reference_field(mesh), left, right, order)


@derived_of_constant
def deformed_body(configuration: Configuration) -> DeformedBody:
    """Return the body in a configuration, computed on first use."""
    q_WG = configuration.q_WG
    body = body_of(configuration.deformable)
    origin = 0.5 * q_WG.min(axis=0) + 0.5 * q_WG.max(axis=0)
    vertices = q_WG - origin
    is_solid, gradients = _fields(vertices, body.tetrahedra, body.field)
    element_boxes = _box_elements(vertices, body.tetrahedra)
    boxes = _fit_nodes(element_boxes, body.left, body.right, body.order)
    reach = float(np.abs(vertices).max())
    return DeformedBody(origin, reach, vertices, is_solid, gradients, element_boxes, boxes)


@lean_kernel
def _gradient(vertices, tetrahedra, field, t):
    """Return (is_solid, gradient) of the linear field of a tetrahedron."""
    i, j, k, m = tetrahedra[t, 0], tetrahedra[t, 1], tetrahedra[t, 2], tetrahedra[t, 3]
    a = load_vector(vertices, i)
    e1 = subtract(load_vector(vertices, j), a)
    e2 = subtract(load_vector(vertices, k), a)
    e3 = subtract(load_vector(vertices, m), a)
    n3 = cross(e1, e2)
    determinant = dot(n3, e3)
    if not determinant > FLAT_TETRAHEDRON * norm(e1) * norm(e2) * norm(e3):
        return False, (0.0, 0.0, 0.0)
    # The rows of the inverse of (e1 e2 e3)^T are the gradients of the barycentric coordinates.
    total = scale(field[j] - field[i], cross(e2, e3))
    total = axpy(field[k] - field[i], cross(e3, e1), total)
    total = axpy(field[m] - field[i], n3, total)
    return True, scale(1.0 / determinant, total)


@kernel
def _fields(vertices, tetrahedra, field):
    """Return (is_solid (t,), gradients (t, 3)) of all tetrahedra."""
    is_solid = np.empty(len(tetrahedra), np.bool_)
    gradients = np.empty((len(tetrahedra), 3))
    for t in range(len(tetrahedra)):
        is_solid[t], gradient = _gradient(vertices, tetrahedra, field, t)
        store_vector(gradients, t, gradient)
    return is_solid, gradients


@kernel
def _box_elements(vertices, tetrahedra):
    """Return (t, 6) centres and half extents of the tetrahedra's boxes."""
    boxes = np.empty((len(tetrahedra), 6))
    for t in range(len(tetrahedra)):
        for axis in range(3):
            low = high = vertices[tetrahedra[t, 0], axis]
            for k in range(1, 4):
                x = vertices[tetrahedra[t, k], axis]
                low, high = min(low, x), max(high, x)
            boxes[t, axis] = 0.5 * low + 0.5 * high
            boxes[t, axis + 3] = 0.5 * high - 0.5 * low
    return boxes


@kernel
def _fit_nodes(elements, left, right, order):
    """Return (n, 6) the boxes of the nodes around those of elements; children follow parents."""
    boxes = np.empty((len(left), 6))
    for back in range(len(left)):
        node = len(left) - 1 - back
        for axis in range(3):
            low, high = np.inf, -np.inf
            if left[node] < 0:
                for slot in range(-1 - left[node], -1 - left[node] + right[node]):
                    centre, half = elements[order[slot], axis], elements[order[slot], axis + 3]
                    low, high = min(low, centre - half), max(high, centre + half)
            else:
                for child in (left[node], right[node]):
                    centre, half = boxes[child, axis], boxes[child, axis + 3]
                    low, high = min(low, centre - half), max(high, centre + half)
            boxes[node, axis] = 0.5 * low + 0.5 * high
            boxes[node, axis + 3] = 0.5 * high - 0.5 * low
    return boxes
