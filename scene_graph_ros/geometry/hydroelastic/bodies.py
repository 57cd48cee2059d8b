"""One body: the mesh of a shape, the pressure field in it and its bounding volume hierarchy."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.hydroelastic.elements import (
    element_boxes,
    linear_fields,
    triangle_normals,
)
from scene_graph_ros.geometry.hydroelastic.fields import compliant_solid
from scene_graph_ros.geometry.meshes.bvh import build_bvh
from scene_graph_ros.geometry.meshes.cache import BuildCache
from scene_graph_ros.geometry.meshes.tessellate import tessellate_surface
from scene_graph_ros.geometry.model.hydroelastic_properties import HydroelasticProperties
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.shapes.shape import Shape

__all__ = ["Body", "body_of"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_CAPACITY = 1024


class Body(NamedTuple):
    """One body of a ``BodyTable``, with rows counted from 0; see there."""

    vertices: FloatArray
    elements: IntArray
    pressure: FloatArray
    gradient: FloatArray
    constant: FloatArray
    normals: FloatArray
    node_lower: FloatArray
    node_upper: FloatArray
    node_left: IntArray
    node_right: IntArray
    order: IntArray


_bodies: BuildCache[Body] = BuildCache(_CAPACITY)


def body_of(shape: Shape, properties: HydroelasticProperties) -> Body:
    """Return the body of a shape with hydroelastic properties, built once per process.

    Raises:
        MeshError: the shape has no surface or no volume, or its mesh would be too large.

    """
    return _bodies.get((shape, properties), lambda: _build(shape, properties))


def _build(shape: Shape, properties: HydroelasticProperties) -> Body:
    if shape.kind == ShapeKind.HALF_SPACE:
        return _half_space(properties)
    if properties.is_compliant:
        return _volume(shape, properties)
    return _surface(shape, properties.resolution_hint)


def _volume(shape: Shape, properties: HydroelasticProperties) -> Body:
    solid = compliant_solid(shape, properties.resolution_hint, properties.margin)
    vertices, elements = np.array(solid.vertices), np.array(solid.tetrahedra)
    pressure = properties.modulus * solid.extent
    gradient, constant = linear_fields(vertices, elements, pressure)
    tree = build_bvh(*element_boxes(vertices, elements, 4))
    return Body(
        vertices, elements, pressure, gradient, constant, np.zeros((len(elements), 3)), *tree
    )


def _surface(shape: Shape, resolution_hint: float | None) -> Body:
    points, triangles = tessellate_surface(shape, resolution_hint)
    vertices, n = np.array(points), len(triangles)
    elements = np.full((n, 4), -1, dtype=np.int64)
    elements[:, :3] = triangles
    normals = triangle_normals(vertices, elements)
    tree = build_bvh(*element_boxes(vertices, elements, 3))
    return Body(
        vertices, elements, np.zeros(len(vertices)), np.zeros((n, 3)), np.zeros(n), normals, *tree
    )


def _half_space(properties: HydroelasticProperties) -> Body:
    """Return a body without vertices and tree: one element with the slab's field, or none."""
    n = 1 if properties.is_compliant else 0
    gradient = np.zeros((n, 3))
    if properties.is_compliant:
        assert properties.slab_thickness is not None  # the properties were checked
        gradient[0, 2] = -properties.modulus / properties.slab_thickness
    no_rows, no_boxes = np.zeros(0, dtype=np.int64), np.zeros((0, 3))
    return Body(
        vertices=np.zeros((0, 3)),
        elements=np.full((n, 4), -1, dtype=np.int64),
        pressure=np.zeros(0),
        gradient=gradient,
        constant=np.zeros(n),
        normals=np.zeros((n, 3)),
        node_lower=no_boxes,
        node_upper=no_boxes,
        node_left=no_rows,
        node_right=no_rows,
        order=np.zeros(n, dtype=np.int64),
    )
