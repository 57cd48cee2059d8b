"""The extent in a compliant body: 0 on its surface, 1 where it is deepest.

For meshes with tetrahedra of their own it is made here: the distance to the surface at the
vertices, over the largest of them, and linear between. A tetrahedron with all its vertices on the
surface would have no field, so it is cut into four at its centroid.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes.tessellate import Solid, solid_of, tessellate_volume
from scene_graph_ros.geometry.meshes.tessellate.margin import grown
from scene_graph_ros.geometry.meshes.volume_mesh import VolumeMesh
from scene_graph_ros.geometry.query.point.batch import distance_points
from scene_graph_ros.geometry.shapes.mesh import Mesh
from scene_graph_ros.geometry.shapes.shape import Shape
from scene_graph_ros.geometry.tables.shape_table import build_shape_table

__all__ = ["compliant_solid", "solid_of_volume_mesh"]

_FACES = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])


def compliant_solid(shape: Shape, resolution_hint: float | None, margin: float) -> Solid:
    """Return the tetrahedra of a shape with the extent at their vertices.

    Args:
        shape: any but a half space.
        resolution_hint: metres; needed by curved shapes.
        margin: metres by which the solid is grown, see ``solid_of``.

    Raises:
        PropertyError, MeshError: as ``tessellate_volume``.

    """
    solid = solid_of(shape, resolution_hint, margin)
    if solid is not None:
        return solid
    mesh = tessellate_volume(shape, resolution_hint)
    return solid_of_volume_mesh(mesh, margin, repr(shape))


def solid_of_volume_mesh(mesh: VolumeMesh, margin: float, name: str) -> Solid:
    """Return a mesh with the distance to its own boundary, scaled to 1, at its vertices.

    Raises:
        MeshError: no vertex is inside by more than rounding, or the margin is too large.

    """
    vertices, tetrahedra, triangles = _split_flat(*_surface_first(mesh))
    count = int(triangles.max()) + 1
    surface = Mesh(vertices=vertices[:count], faces=triangles)
    columns = distance_points(
        build_shape_table([surface], [True]), np.eye(4)[None], vertices[count:], math.inf
    )
    depths = np.zeros(len(vertices))
    depths[count:] = np.abs(columns[2])
    deepest = float(depths.max())
    if not (depths[count:] > 0.0).all():
        raise MeshError(f"{name}: a vertex inside lies on the surface")
    solid = Solid(vertices, tetrahedra, triangles, depths / deepest)
    return grown(solid, margin, deepest, name) if margin else solid


def _surface_first(
    mesh: VolumeMesh,
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.int64]]:
    """Return vertices, tetrahedra and boundary triangles with the boundary's vertices first."""
    inside = ~mesh.is_on_boundary()
    order = np.argsort(inside, kind="stable")
    number = np.empty_like(order)
    number[order] = np.arange(len(order))
    return mesh.vertices[order], number[mesh.tetrahedra], number[mesh.boundary_triangles()]


def _split_flat(
    vertices: NDArray[np.float64], tetrahedra: NDArray[np.int64], triangles: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.int64]]:
    """Cut tetrahedra with all their vertices on the surface into four at their centroids."""
    flat = (tetrahedra <= triangles.max()).all(axis=1)
    apex = len(vertices) + np.arange(int(flat.sum()))
    centroids = vertices[tetrahedra[flat]].mean(axis=1)
    parts = np.empty((len(apex), 4, 4), dtype=np.int64)
    parts[:, :, 0] = apex[:, None]
    parts[:, :, 1:] = tetrahedra[flat][:, _FACES]
    return (
        np.concatenate([vertices, centroids]),
        np.concatenate([tetrahedra[~flat], parts.reshape(-1, 4)]),
        triangles,
    )
