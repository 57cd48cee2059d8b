"""Meshes of shapes: surfaces of triangles, and solids of tetrahedra with how deep they are."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes.tessellate.box import surface_box, volume_box
from scene_graph_ros.geometry.meshes.tessellate.capsule import surface_capsule, volume_capsule
from scene_graph_ros.geometry.meshes.tessellate.convex import surface_convex, volume_convex
from scene_graph_ros.geometry.meshes.tessellate.cylinder import surface_cylinder, volume_cylinder
from scene_graph_ros.geometry.meshes.tessellate.ellipsoid import (
    surface_ellipsoid,
    volume_ellipsoid,
)
from scene_graph_ros.geometry.meshes.tessellate.mesh import is_star, surface_mesh, volume_mesh
from scene_graph_ros.geometry.meshes.tessellate.solid import Solid
from scene_graph_ros.geometry.meshes.volume_mesh import VolumeMesh
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.shapes.mesh import Mesh
from scene_graph_ros.geometry.shapes.shape import Shape

__all__ = ["Solid", "solid_of", "tessellate_surface", "tessellate_volume"]

_SURFACE: dict[ShapeKind, Callable[..., tuple[NDArray[np.float64], NDArray[np.int64]]]] = {
    ShapeKind.SPHERE: surface_ellipsoid,
    ShapeKind.CAPSULE: surface_capsule,
    ShapeKind.BOX: surface_box,
    ShapeKind.CYLINDER: surface_cylinder,
    ShapeKind.ELLIPSOID: surface_ellipsoid,
    ShapeKind.CONVEX: surface_convex,
    ShapeKind.MESH: surface_mesh,
}
_SOLID: dict[ShapeKind, Callable[..., Solid]] = {
    ShapeKind.SPHERE: volume_ellipsoid,
    ShapeKind.CAPSULE: volume_capsule,
    ShapeKind.BOX: volume_box,
    ShapeKind.CYLINDER: volume_cylinder,
    ShapeKind.ELLIPSOID: volume_ellipsoid,
    ShapeKind.CONVEX: volume_convex,
    ShapeKind.MESH: volume_convex,
}


def _function(table: dict[ShapeKind, Any], shape: Shape) -> Any:
    if shape.kind not in table:
        raise MeshError(f"there is no mesh of {shape!r}: it has no bounded surface")
    return table[shape.kind]


def tessellate_surface(
    shape: Shape, resolution_hint: float | None = None
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return the surface of a shape in G as triangles.

    Args:
        shape: any but a half space.
        resolution_hint: metres, no edge of a curved part is longer; flat parts need none.

    Returns:
        vertices (v, 3) in metres, those of curved parts on the surface, and triangles (t, 3),
        counter-clockwise seen from outside.

    Raises:
        PropertyError: a curved shape without a hint.
        MeshError: the shape is a half space or a point, or the mesh would be too large.

    """
    result: tuple[NDArray[np.float64], NDArray[np.int64]]
    result = _function(_SURFACE, shape)(shape, resolution_hint)
    return result


def tessellate_volume(shape: Shape, resolution_hint: float | None = None) -> VolumeMesh:
    """Return the inside of a shape in G as tetrahedra; see ``tessellate_surface``.

    Raises:
        PropertyError: a curved shape without a hint.
        MeshError: the shape is a half space, a point or a flat hull, a mesh is not closed, or the
            result would be too large.

    """
    if isinstance(shape, Mesh):
        return volume_mesh(shape, resolution_hint)
    solid = solid_of(shape, resolution_hint)
    assert solid is not None  # only a mesh has no field of its own
    return VolumeMesh.trusted(solid.vertices, solid.tetrahedra)


def solid_of(shape: Shape, resolution_hint: float | None, margin: float = 0.0) -> Solid | None:
    """Return the inside of a shape with the extent at its vertices.

    Args:
        shape: any but a half space.
        resolution_hint: metres.
        margin: metres by which the solid is grown; the extent stays 0 on the shape's own surface
            and is negative outside of it.

    Returns:
        None for a mesh whose extent is not known from how its tetrahedra were made: one that is
        not convex, or comes with its own.

    Raises:
        PropertyError, MeshError: as ``tessellate_volume``.

    """
    if isinstance(shape, Mesh) and not is_star(shape):
        return None
    result: Solid = _function(_SOLID, shape)(shape, resolution_hint, margin)
    return result
