"""Meshes: their own triangles; their tetrahedra from a file, from a star or from a library."""

from __future__ import annotations

from collections.abc import Hashable

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes.cache import BuildCache
from scene_graph_ros.geometry.meshes.sources import (
    is_convex,
    source_identity,
    surface_of,
    volume_of,
)
from scene_graph_ros.geometry.meshes.tessellate.convex import volume_convex
from scene_graph_ros.geometry.meshes.tessellate.counts import MAX_ELEMENTS
from scene_graph_ros.geometry.meshes.tetrahedralize import tetrahedralize
from scene_graph_ros.geometry.meshes.volume_io import VOLUME_FILE_TYPES
from scene_graph_ros.geometry.meshes.volume_mesh import VolumeMesh
from scene_graph_ros.geometry.shapes.mesh import Mesh

__all__ = ["is_star", "surface_mesh", "volume_mesh"]

_CAPACITY = 256
_volumes: BuildCache[VolumeMesh] = BuildCache(_CAPACITY)

_TETRAHEDRA_PER_CUBE = 6.0
"""About how many tetrahedra fill a cube whose sides are as long as their edges."""


def is_star(shape: Mesh) -> bool:
    """Tell whether the tetrahedra of a mesh are a star over its hull: it is convex, no file."""
    return shape.file_type not in VOLUME_FILE_TYPES and is_convex(shape)


def surface_mesh(
    shape: Mesh, resolution_hint: float | None = None
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return the vertices (v, 3), m, and the triangles (t, 3) of a mesh, as they are.

    Raises MeshError as ``surface_of`` does.
    """
    del resolution_hint
    surface = surface_of(shape)
    return surface.vertices, surface.triangles


def volume_mesh(shape: Mesh, resolution_hint: float | None = None) -> VolumeMesh:
    """Return the inside of a mesh as tetrahedra.

    Those of a .vtk or .vtu file are taken as they are. A convex mesh becomes a star, which a hint
    does not change. Any other is filled by a library, once: the result is kept on disk.

    Raises:
        MeshError: the mesh is not closed, no library is installed, it failed, or the hint asks
            for too many tetrahedra.

    """
    if shape.file_type in VOLUME_FILE_TYPES:
        return volume_of(shape)
    if is_convex(shape):
        solid = volume_convex(shape)
        return VolumeMesh.trusted(solid.vertices, solid.tetrahedra)
    if resolution_hint is not None:
        _require_moderate(shape, resolution_hint)
    key: Hashable = (source_identity(shape), resolution_hint)
    return _volumes.get(
        key, lambda: tetrahedralize(surface_of(shape), resolution_hint, repr(shape))
    )


def _require_moderate(shape: Mesh, hint: float) -> None:
    """Refuse a hint by which the bounding box would be cut into more than MAX_ELEMENTS."""
    vertices = surface_of(shape).vertices
    sides = vertices.max(axis=0) - vertices.min(axis=0)
    count = _TETRAHEDRA_PER_CUBE * float(np.prod(np.maximum(sides / hint, 1.0)))
    if count > MAX_ELEMENTS:
        raise MeshError(
            f"resolution_hint {hint:g} m of {shape!r}, {float(sides.max()):g} m in size, asks for"
            f" about {count:.3g} tetrahedra; more than {MAX_ELEMENTS} are refused: make it larger"
        )
