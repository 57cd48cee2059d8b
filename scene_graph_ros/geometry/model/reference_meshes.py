"""The reference mesh of a deformable geometry: given as it is, or made of a shape."""

from __future__ import annotations

from collections.abc import Iterable
import math
from typing import Any, TYPE_CHECKING

from scene_graph_ros.geometry.errors import DeformableError
from scene_graph_ros.geometry.meshes.cache import BuildCache
from scene_graph_ros.geometry.model.deformable import Deformable, DEFORMABLE_GROUP
from scene_graph_ros.geometry.model.instance import GeometryInstance
from scene_graph_ros.geometry.model.mesh_properties import check_solid, mesh_meant
from scene_graph_ros.geometry.model.properties import GeometryProperties, ProximityProperties
from scene_graph_ros.geometry.model.roles import Role
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.reals import as_float
from scene_graph_ros.geometry.shapes.box import Box
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.shapes.mesh_shape import MeshShape
from scene_graph_ros.geometry.shapes.shape import Shape

if TYPE_CHECKING:
    from scene_graph_ros.geometry.meshes.volume_mesh import VolumeMesh

__all__ = ["make_deformable", "read_embedded_meshes"]

_INSIDE = 2.0
_CAPACITY = 64
_meshes: BuildCache[VolumeMesh] = BuildCache(_CAPACITY)


def make_deformable(
    instance: GeometryInstance, resolution_hint: float | None, reference_mesh: VolumeMesh | None
) -> Deformable:
    """Return the deformable that an instance on the world frame stands for.

    Raises DeformableError for a half space, a hint that is no positive length, or a mesh that is
    no VolumeMesh or comes with a hint; MeshError if the shape cannot be divided into tetrahedra;
    PropertyError for proximity properties that say nothing of a mesh.
    """
    from scene_graph_ros.geometry.meshes.volume_mesh import VolumeMesh

    label = f"deformable geometry {instance.name()!r}"
    hint: Any = resolution_hint
    if hint is not None:
        length = as_float(hint)
        if length is None or not 0.0 < length < math.inf:
            raise DeformableError(
                f"{label}: resolution_hint must be a positive number of metres, not {quoted(hint)}"
            )
        hint = length
    if reference_mesh is None:
        return Deformable(_tessellated(instance, hint, label), instance.pose())
    mesh: Any = reference_mesh
    if not isinstance(mesh, VolumeMesh):
        raise DeformableError(f"{label}: reference_mesh must be a VolumeMesh, not {mesh!r}")
    if hint is not None:
        raise DeformableError(
            f"{label}: a reference_mesh is taken as it is, resolution_hint {hint!r} is for shapes"
        )
    return Deformable(mesh, instance.pose())


def read_embedded_meshes(roles: Iterable[GeometryProperties | None]) -> None:
    """Read the meshes that properties of roles ask to embed, so that errors come now.

    Raises PropertyError, InvalidShapeError or MeshError.
    """
    for properties in roles:
        if isinstance(properties, GeometryProperties) and properties.has_group(DEFORMABLE_GROUP):
            from scene_graph_ros.geometry.model.driven_mesh import read_embedded_mesh

            read_embedded_mesh(properties)


def _shape_meant(instance: GeometryInstance) -> Shape:
    """Return the shape, a mesh as the proximity properties say: repaired, in pieces, a solid.

    Raises MeshError for one that must be a solid and is none, PropertyError.
    """
    properties = instance.properties(Role.PROXIMITY)
    if not isinstance(properties, ProximityProperties):
        return instance.shape()
    shape: Shape = mesh_meant(instance.shape(), properties)
    check_solid(shape, properties, instance.name())
    return shape


def _tessellated(instance: GeometryInstance, hint: float | None, label: str) -> VolumeMesh:
    """Return the reference mesh of a shape; see SceneGraph.register_deformable_geometry.

    The tessellators make as few tetrahedra as represent a shape and its depth. To deform, it needs
    more: a box becomes a grid, and inside other shapes edges longer than twice the hint are cut.
    """
    shape = _shape_meant(instance)
    if shape.kind == ShapeKind.HALF_SPACE:
        raise DeformableError(f"{label}: a half space has no end, and so no volume mesh")
    from scene_graph_ros.geometry.meshes.box_grid import grid_box
    from scene_graph_ros.geometry.meshes.tessellate import tessellate_volume
    from scene_graph_ros.geometry.meshes.volume_io import VOLUME_FILE_TYPES
    from scene_graph_ros.geometry.meshes.volume_refinement import with_short_edges

    if hint is None:
        return tessellate_volume(shape, None)
    length = float(hint)
    if isinstance(shape, Box):
        return grid_box(shape, length)
    if isinstance(shape, MeshShape) and shape.file_type in VOLUME_FILE_TYPES:
        return tessellate_volume(shape, length)
    return _meshes.get(
        (shape, length),
        lambda: with_short_edges(tessellate_volume(shape, length), _INSIDE * length),
    )
