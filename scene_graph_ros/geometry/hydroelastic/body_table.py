"""All geometries with hydroelastic properties as arrays for the contact kernels.

Each body is built once: geometries with equal shapes and equal properties share it, in one scene
and between scenes. Positions, normals and gradients are in the geometry's frame G, SI units.

**Fields.** The pressure of a compliant body is ``E * extent(x)``, linear in every tetrahedron,
with the hydroelastic modulus E. The extent is 0 on the surface and 1 at the deepest place: for
sphere and ellipsoid the centre, and linear along rays from it; for capsule, box and cylinder the
medial axis, and linear in the distance to the surface; for a convex hull the centre of the largest
ball inside, and linear along rays; for a mesh the deepest vertex, and linear in the distance at
the vertices. A compliant half space has ``E * depth / slab_thickness``, without an end.

**Margin.** A compliant body with a margin is grown by it. The field is that of the body without
one, continued: zero on the original surface and negative in the layer around it. Where a contact
surface has negative pressure, the bodies do not touch yet.
"""

from __future__ import annotations

from collections.abc import Sequence
import enum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.hydroelastic.bodies import Body, body_of
from scene_graph_ros.geometry.model.derived import derived
from scene_graph_ros.geometry.model.hydroelastic_properties import (
    HydroelasticProperties,
    read_hydroelastic_properties,
)
from scene_graph_ros.geometry.model.properties import ProximityProperties
from scene_graph_ros.geometry.model.roles import Role
from scene_graph_ros.geometry.model.state import GeometryState
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.shapes.shape import Shape

__all__ = ["BodyKind", "BodyTable", "body_table", "build_body_table"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


class BodyKind(enum.IntEnum):
    """The kind of a geometry for contact surfaces."""

    NONE = 0
    RIGID_SURFACE = 1
    COMPLIANT_VOLUME = 2
    RIGID_HALF_SPACE = 3
    COMPLIANT_HALF_SPACE = 4


class BodyTable(NamedTuple):
    """n geometries and the b bodies they share; all arrays C-contiguous and writable.

    Bodies stand in compressed rows. Half spaces have no vertices and no nodes; a rigid one has no
    element, a compliant one has one, whose vertices are -1.
    """

    kind: NDArray[np.int32]
    """(n,) a BodyKind; row i is row i of the proximity arrays."""
    body: IntArray
    """(n,) index of the body; -1 where the kind is NONE."""
    margin: FloatArray
    """(n,) metres by which a compliant geometry is grown; 0 for the others."""
    element_start: IntArray
    """(b+1,) body k owns elements ``element_start[k]:element_start[k+1]``."""
    elements: IntArray
    """(E, 4) rows of ``vertices``: tetrahedra, positive, or triangles, counter-clockwise from
    outside, with -1 as the fourth."""
    vertex_start: IntArray
    """(b+1,)."""
    vertices: FloatArray
    """(V, 3) metres."""
    pressure: FloatArray
    """(V,) pascals; 0 for rigid bodies."""
    gradient_G: FloatArray
    """(E, 3) Pa/m: the field of an element is ``gradient_G . x_G + constant``; 0 if rigid."""
    constant: FloatArray
    """(E,) pascals."""
    normals: FloatArray
    """(E, 3) unit outward normals of triangles; 0 for the others."""
    node_start: IntArray
    """(b+1,) body k owns the nodes ``node_start[k]:node_start[k+1]`` of its tree of boxes."""
    node_lower: FloatArray
    """(N, 3) metres; the first node of a body is its root."""
    node_upper: FloatArray
    """(N, 3) metres."""
    node_left: IntArray
    """(N,) the left child, or ``-1 - first`` at a leaf, whose elements are ``order[first : first +
    node_right]``; nodes, ``order`` and its slots count from 0 in each body."""
    node_right: IntArray
    """(N,) the right child, or the number of elements at a leaf."""
    order: IntArray
    """(E,) elements of the body in the order of its leaves; 0 for half spaces."""


_KINDS = {
    (False, False): BodyKind.RIGID_SURFACE,
    (False, True): BodyKind.COMPLIANT_VOLUME,
    (True, False): BodyKind.RIGID_HALF_SPACE,
    (True, True): BodyKind.COMPLIANT_HALF_SPACE,
}


@derived(Role.PROXIMITY)
def body_table(state: GeometryState) -> BodyTable:
    """Return the bodies of a model, built on first use and kept while they hold."""
    ids = state.rigid_ids(Role.PROXIMITY)
    records = [state.geometries[geometry_id] for geometry_id in ids]
    properties = [record.properties[Role.PROXIMITY] for record in records]
    return build_body_table(
        [record.shape for record in records],
        [p for p in properties if isinstance(p, ProximityProperties)],
        [record.name for record in records],
    )


def build_body_table(
    shapes: Sequence[Shape],
    properties: Sequence[ProximityProperties],
    names: Sequence[str] | None = None,
) -> BodyTable:
    """Build the table of n geometries, one row each.

    Args:
        shapes: of any kind.
        properties: those of the proximity role; without a compliance type the row is NONE.
        names: of the geometries, for messages; by default those of their shapes.

    Raises:
        PropertyError: a property that the shape needs is missing, or has no such value.
        MeshError: a shape has no volume (or no surface, if rigid), a mesh cannot be filled with
            tetrahedra, or the mesh would be too large.

    """
    n = len(shapes)
    kind = np.zeros(n, dtype=np.int32)
    rows = np.full(n, -1, dtype=np.int64)
    margin = np.zeros(n)
    bodies: list[Body] = []
    index: dict[tuple[Shape, HydroelasticProperties], int] = {}
    labels = [shape.type_name for shape in shapes] if names is None else names
    for row, (shape, own, label) in enumerate(zip(shapes, properties, labels, strict=True)):
        values = read_hydroelastic_properties(shape, own, label)
        if values is None:
            continue
        key = (shape, values)
        if key not in index:
            index[key] = len(bodies)
            bodies.append(_named_body(shape, values, label))
        rows[row] = index[key]
        margin[row] = values.margin
        kind[row] = _KINDS[shape.kind == ShapeKind.HALF_SPACE, values.is_compliant]
    return _packed(kind, rows, margin, bodies)


def _named_body(shape: Shape, values: HydroelasticProperties, name: str) -> Body:
    """Return the body of a geometry; errors name the geometry."""
    try:
        return body_of(shape, values)
    except MeshError as error:
        raise MeshError(f"geometry {name!r}: {error}") from error


def _packed(
    kind: NDArray[np.int32], rows: IntArray, margin: FloatArray, bodies: list[Body]
) -> BodyTable:
    vertex_start = _starts([len(body.vertices) for body in bodies])
    shifted = [
        np.where(body.elements >= 0, body.elements + first, -1)
        for body, first in zip(bodies, vertex_start[:-1], strict=True)
    ]
    return BodyTable(
        kind=kind,
        body=rows,
        margin=margin,
        element_start=_starts([len(body.elements) for body in bodies]),
        elements=_stack(shifted, (4,), np.int64),
        vertex_start=vertex_start,
        vertices=_stack([body.vertices for body in bodies], (3,), np.float64),
        pressure=_stack([body.pressure for body in bodies], (), np.float64),
        gradient_G=_stack([body.gradient for body in bodies], (3,), np.float64),
        constant=_stack([body.constant for body in bodies], (), np.float64),
        normals=_stack([body.normals for body in bodies], (3,), np.float64),
        node_start=_starts([len(body.node_left) for body in bodies]),
        node_lower=_stack([body.node_lower for body in bodies], (3,), np.float64),
        node_upper=_stack([body.node_upper for body in bodies], (3,), np.float64),
        node_left=_stack([body.node_left for body in bodies], (), np.int64),
        node_right=_stack([body.node_right for body in bodies], (), np.int64),
        order=_stack([body.order for body in bodies], (), np.int64),
    )


def _starts(lengths: Sequence[int]) -> IntArray:
    """Return the starts of compressed rows of these lengths, and the end of the last one."""
    return np.concatenate([[0], np.cumsum(np.asarray(lengths, dtype=np.int64))]).astype(np.int64)


def _stack(parts: Sequence[np.ndarray], shape: tuple[int, ...], dtype: type) -> np.ndarray:
    """Concatenate along the first axis into a writable C-contiguous array, also if none."""
    return np.concatenate([np.zeros((0, *shape), dtype=dtype), *parts])
