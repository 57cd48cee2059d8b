"""Surfaces that a deformable geometry carries along: drawn, seen by cameras, or in contact.

A role's driven mesh is the boundary of the volume mesh. A property of the role,
``("deformable", "embedded_mesh")``, may name a finer one, as a file or as a ``Mesh``, given in the
geometry's frame like the reference mesh; each of its vertices then keeps its barycentric
coordinates in the tetrahedron that holds it, so that it moves with the material.
"""

from __future__ import annotations

import os
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.meshes.sources import load_surface
from scene_graph_ros.geometry.meshes.surface_mesh import SurfaceMesh
from scene_graph_ros.geometry.meshes.volume_mesh import VolumeMesh
from scene_graph_ros.geometry.model.deformable import (
    Configuration,
    Deformable,
    DEFORMABLE_GROUP,
)
from scene_graph_ros.geometry.model.derived import derived_of_constant
from scene_graph_ros.geometry.model.properties import GeometryProperties
from scene_graph_ros.geometry.property_errors import PropertyValueError
from scene_graph_ros.geometry.shapes.mesh import Mesh

__all__ = [
    "EMBEDDED_MESH",
    "DrivenMesh",
    "driven_mesh",
    "driven_positions",
    "read_embedded_mesh",
]

EMBEDDED_MESH = "embedded_mesh"


class DrivenMesh(NamedTuple):
    """A surface whose vertices are fixed combinations of those of a volume mesh."""

    surface: SurfaceMesh
    """In the reference configuration, in G."""
    corners: NDArray[np.int64]
    """(n, k) the vertices of the volume mesh that drive each vertex of the surface."""
    weights: NDArray[np.float64]
    """(n, k) how much each of them counts; rows sum to 1. k is 1 for the boundary, else 4."""


def _embedded_shape(properties: GeometryProperties) -> Mesh | None:
    """Return the mesh that the properties name, or None. Raises PropertyError for no mesh."""
    value = properties.get_property_or_default(DEFORMABLE_GROUP, EMBEDDED_MESH, None)
    if value is None or isinstance(value, Mesh):
        return value
    if not isinstance(value, (str, os.PathLike)):
        raise PropertyValueError(
            f"property ({DEFORMABLE_GROUP!r}, {EMBEDDED_MESH!r}) must be the path of a mesh file"
            f" or a Mesh, not {value!r}"
        )
    return Mesh(value)


def read_embedded_mesh(properties: GeometryProperties) -> None:
    """Read and keep the mesh that a role's properties name, so that errors come now.

    Raises PropertyError for a value that is neither path nor Mesh, InvalidShapeError or MeshError
    for a file that cannot be read or is no mesh.
    """
    shape = _embedded_shape(properties)
    if shape is not None:
        SurfaceMesh(*load_surface(shape))


def driven_mesh(deformable: Deformable, properties: GeometryProperties) -> DrivenMesh:
    """Return the driven mesh of a role, made on first use."""
    return _driven_mesh(deformable, _embedded_shape(properties))


@derived_of_constant
def _driven_mesh(deformable: Deformable, shape: Mesh | None) -> DrivenMesh:
    return _boundary(deformable.mesh) if shape is None else _embed(deformable.mesh, shape)


def driven_positions(mesh: DrivenMesh, configuration: Configuration) -> NDArray[np.float64]:
    """Return the positions ``(n, 3)`` of a driven mesh's vertices in W, in m."""
    return np.einsum("nk,nkj->nj", mesh.weights, configuration.q_WG[mesh.corners])


def _boundary(mesh: VolumeMesh) -> DrivenMesh:
    used, triangles = np.unique(mesh.boundary_triangles(), return_inverse=True)
    surface = SurfaceMesh(mesh.vertices[used], triangles.reshape(-1, 3))
    return DrivenMesh(surface, used.reshape(-1, 1), np.ones((len(used), 1)))


def _embed(mesh: VolumeMesh, shape: Mesh) -> DrivenMesh:
    from scene_graph_ros.geometry.meshes.embedding import embed_points

    surface = SurfaceMesh(*load_surface(shape))
    tetrahedra, weights = embed_points(mesh.vertices, mesh.tetrahedra, surface.vertices)
    return DrivenMesh(surface, mesh.tetrahedra[tetrahedra], weights)
