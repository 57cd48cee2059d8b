"""Deformable contact of one snapshot.

The answer about a pair is described in ``against_rigid.py`` and ``between_bodies.py``.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.broadphase.aabb import world_boxes
from scene_graph_ros.geometry.deformable.against_rigid import half_space_faces, surface_faces
from scene_graph_ros.geometry.deformable.between_bodies import deformable_faces
from scene_graph_ros.geometry.deformable.body import (
    Body,
    body_of,
    deformed_body,
    DeformedBody,
)
from scene_graph_ros.geometry.deformable.faces import Faces, unpack, weights_in
from scene_graph_ros.geometry.deformable.results import (
    ContactParticipation,
    DeformableContact,
    DeformableContactSurface,
)
from scene_graph_ros.geometry.deformable.rigid_surface import rigid_surface, RigidSurface
from scene_graph_ros.geometry.model.ids import GeometryId
from scene_graph_ros.geometry.model.roles import Role
from scene_graph_ros.geometry.model.snapshot import Snapshot
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.spatial.sums import product
from scene_graph_ros.geometry.tolerances import (
    CONTACT_RESOLUTION,
    CONTACT_TIE,
    PLACED_RESOLUTION,
)

__all__ = ["compute_deformable_contact"]

FloatArray = NDArray[np.float64]


class _Soft:
    """A deformable geometry with the proximity role, in its present configuration."""

    def __init__(self, snapshot: Snapshot, geometry_id: GeometryId) -> None:
        configuration = snapshot.configuration(geometry_id)
        self.id = geometry_id
        self.body: Body = body_of(configuration.deformable)
        self.shape: DeformedBody = deformed_body(configuration)
        self.takes_part = np.zeros(len(self.body.field), np.bool_)
        box = self.shape.boxes[0]
        self.lower: FloatArray = self.shape.origin + box[:3] - box[3:]
        self.upper: FloatArray = self.shape.origin + box[:3] + box[3:]


def compute_deformable_contact(snapshot: Snapshot) -> DeformableContact:
    """Return the surfaces of contact of all deformable geometries with the proximity role."""
    softs = [_Soft(snapshot, i) for i in snapshot.state.deformable_ids(Role.PROXIMITY)]
    surfaces = []
    if softs:
        lower, upper = _rigid_boxes(snapshot)
        for k, soft in enumerate(softs):
            found = _against_rigid(snapshot, soft, lower, upper)
            found += _against_soft(snapshot, soft, softs[k + 1 :])
            surfaces += sorted(found, key=lambda surface: surface.id_B)
    participation = {soft.id: ContactParticipation(soft.takes_part) for soft in softs}
    return DeformableContact(surfaces, participation)


def _rigid_boxes(snapshot: Snapshot) -> tuple[FloatArray, FloatArray]:
    """Return the corners (n, 3) of the rigid geometries' boxes; a half space is everywhere."""
    proximity = snapshot.proximity
    lower, upper = world_boxes(proximity.table, snapshot.X_WG)
    is_half_space = proximity.table.kind == ShapeKind.HALF_SPACE
    lower[is_half_space], upper[is_half_space] = -np.inf, np.inf
    return lower, upper


def _against_rigid(
    snapshot: Snapshot, soft: _Soft, lower: FloatArray, upper: FloatArray
) -> list[DeformableContactSurface]:
    state, proximity = snapshot.state, snapshot.proximity
    near = ((lower <= soft.upper) & (upper >= soft.lower)).all(axis=1)
    result = []
    for row in np.flatnonzero(near):
        other = proximity.geometry_ids[row]
        if state.collision_filtered(soft.id, other):
            continue
        X_WG = snapshot.X_WG[row]
        record = state.geometries[other]
        if record.shape.kind == ShapeKind.HALF_SPACE:
            faces = _half_space_faces(soft, X_WG)
        else:
            surface = rigid_surface(record.shape, record.properties[Role.PROXIMITY])
            if surface is None:
                continue
            faces = _surface_faces(soft, surface, X_WG)
        if len(faces.areas):
            result.append(_surface(soft, other, faces))
    return result


def _against_soft(
    snapshot: Snapshot, soft: _Soft, others: list[_Soft]
) -> list[DeformableContactSurface]:
    result = []
    for other in others:
        apart = (soft.lower > other.upper) | (soft.upper < other.lower)
        if apart.any() or snapshot.state.collision_filtered(soft.id, other.id):
            continue
        faces = _deformable_faces(soft, other)
        if len(faces.areas):
            result.append(_surface(soft, other.id, faces, other))
    return result


def _limits(soft: _Soft, offset: FloatArray, reach: float) -> tuple[float, float]:
    """Return (slack, resolution) in metres, of a body with another, ``offset`` from its origin.

    ``reach`` is the largest coordinate of the other in its own frame.
    """
    size = max(soft.shape.reach, reach, float(np.abs(offset).max()))
    placed = PLACED_RESOLUTION * float(np.abs(soft.shape.origin).max())
    return CONTACT_TIE * size + placed, CONTACT_RESOLUTION * size + placed


def _half_space_faces(soft: _Soft, X_WG: FloatArray) -> Faces:
    shape = soft.shape
    n, offset = X_WG[:3, 2], X_WG[:3, 3] - shape.origin
    # The point of the plane that is nearest to the body, not one that is far away along it.
    foot = product(n, offset) * n
    slack, resolution = _limits(soft, foot, 0.0)
    rows = half_space_faces(
        shape.vertices,
        soft.body.tetrahedra,
        shape.is_solid,
        tuple(n.tolist()),
        tuple(foot.tolist()),
        slack,
        resolution,
    )
    return unpack(rows)


def _tree(soft: _Soft) -> tuple[Any, ...]:
    """Return a body's tree as the kernels want it."""
    body = soft.body
    return soft.shape.boxes, body.left, body.right, body.order


def _surface_faces(soft: _Soft, surface: RigidSurface, X_WG: FloatArray) -> Faces:
    shape = soft.shape
    offset = X_WG[:3, 3] - shape.origin
    slack, resolution = _limits(soft, offset, surface.reach)
    rows = surface_faces(
        _tree(soft),
        (shape.vertices, soft.body.tetrahedra, shape.is_solid, shape.element_boxes),
        (surface.boxes, surface.left, surface.right, surface.order),
        (surface.vertices, surface.triangles, surface.normals),
        tuple(X_WG[:3, :3].ravel().tolist()),
        tuple(offset.tolist()),
        slack,
        resolution,
    )
    return unpack(rows)


def _fields(soft: _Soft) -> tuple[Any, ...]:
    """Return a body with its field as the kernel wants it."""
    shape, body = soft.shape, soft.body
    return (
        shape.vertices,
        body.tetrahedra,
        shape.is_solid,
        shape.element_boxes,
        body.field,
        shape.gradients,
    )


def _deformable_faces(soft: _Soft, other: _Soft) -> Faces:
    offset = other.shape.origin - soft.shape.origin
    slack, resolution = _limits(soft, offset, other.shape.reach)
    rows = deformable_faces(
        _tree(soft),
        _fields(soft),
        _tree(other),
        _fields(other),
        tuple(offset.tolist()),
        slack,
        resolution,
    )
    return unpack(rows)


def _surface(
    soft: _Soft, id_B: GeometryId, faces: Faces, other: _Soft | None = None
) -> DeformableContactSurface:
    """Return the record of a pair's faces, and note the vertices that take part."""
    tetrahedra, origin = soft.body.tetrahedra, soft.shape.origin
    corners = tetrahedra[faces.element_A]
    weights = weights_in(faces.centroids, soft.shape.vertices, tetrahedra, faces.element_A)
    soft.takes_part[corners] = True
    side_B: dict[str, Any] = {}
    if other is not None:
        shift = origin - other.shape.origin
        indices = other.body.tetrahedra[faces.element_B]
        other.takes_part[indices] = True
        side_B = {
            "tetrahedra_B": faces.element_B,
            "vertex_indices_B": indices,
            "barycentric_coordinates_B": weights_in(
                faces.centroids + shift,
                other.shape.vertices,
                other.body.tetrahedra,
                faces.element_B,
            ),
        }
    return DeformableContactSurface(
        id_A=soft.id,
        id_B=id_B,
        vertices_W=faces.corners + origin,
        face_starts=faces.start,
        contact_points_W=faces.centroids + origin,
        face_areas=faces.areas,
        nhats_BA_W=faces.normals,
        signed_distances=np.minimum(np.einsum("fk,fk->f", weights, soft.body.field[corners]), 0.0),
        tetrahedra_A=faces.element_A,
        vertex_indices_A=corners,
        barycentric_coordinates_A=weights,
        **side_B,
    )
