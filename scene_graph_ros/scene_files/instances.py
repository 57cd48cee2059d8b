"""Turn a geometry of a scene file into the core's types."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry import (
    Box,
    Capsule,
    Convex,
    Cylinder,
    Ellipsoid,
    GeometryInstance,
    HalfSpace,
    HeightField,
    IllustrationProperties,
    Mesh,
    PerceptionProperties,
    PointCloud,
    ProximityProperties,
    Rgba,
    Shape,
    Sphere,
    VoxelGrid,
)
from scene_graph_ros.geometry.model.contact_properties import HYDROELASTIC_GROUP, MATERIAL_GROUP
from scene_graph_ros.geometry.model.deformable import DEFORMABLE_GROUP
from scene_graph_ros.geometry.model.hydroelastic_properties import (
    HydroelasticProperties,
    read_hydroelastic_properties,
)
from scene_graph_ros.geometry.model.properties import GeometryProperties
from scene_graph_ros.geometry.shapes.voxel_runs import from_runs
from scene_graph_ros.geometry.spatial.poses import (
    as_pose,
    pose_from_xyz_rpy,
    poses_from_quaternions,
)
from scene_graph_ros.scene_files.schema import GeometrySpec, PoseSpec
from scene_graph_ros.scene_files.schema_shapes import (
    BoxSpec,
    CapsuleSpec,
    ConvexSpec,
    CylinderSpec,
    EllipsoidSpec,
    HalfSpaceSpec,
    HeightFieldSpec,
    MeshSpec,
    PointCloudSpec,
    ShapeSpec,
    SphereSpec,
    VoxelGridSpec,
)

__all__ = [
    "find_embedded_mesh",
    "find_picture",
    "hydroelastic_of",
    "instance_from_spec",
    "perception_from_spec",
    "pose_from_spec",
    "properties_from_spec",
    "shape_from_spec",
]

EMBEDDED_MESH = "embedded_mesh"
"""Of the group "deformable": see geometry/model/driven_mesh.py."""

_PROPERTIES: dict[str, type[GeometryProperties]] = {
    "proximity": ProximityProperties,
    "illustration": IllustrationProperties,
    "perception": PerceptionProperties,
}


def pose_from_spec(spec: PoseSpec, name: str) -> NDArray[np.float64]:
    """Return the pose ``(4, 4)``.

    Raises InvalidPoseError for a quaternion that is no unit, and a matrix that is not rigid.
    """
    if spec.matrix is not None:
        return as_pose(np.array([*spec.matrix[:3], [0.0, 0.0, 0.0, 1.0]]), name)
    if spec.quaternion is not None:
        return poses_from_quaternions([spec.xyz], [spec.quaternion], name)[0]
    return pose_from_xyz_rpy(np.array(spec.xyz), np.array(spec.rpy or [0.0, 0.0, 0.0]))


def shape_from_spec(spec: ShapeSpec, resolve: Callable[[str], Path]) -> Shape:
    """Return the shape; ``resolve`` finds the file behind a resource.

    Raises InvalidShapeError for a shape that the core refuses, SceneFileError for a missing file.
    """
    match spec:
        case SphereSpec():
            return Sphere(spec.radius)
        case BoxSpec():
            return Box(*spec.size)
        case CapsuleSpec():
            return Capsule(spec.radius, spec.length)
        case CylinderSpec():
            return Cylinder(spec.radius, spec.length)
        case EllipsoidSpec():
            return Ellipsoid(*spec.semi_axes)
        case HalfSpaceSpec():
            return HalfSpace()
        case ConvexSpec() | MeshSpec():
            return _mesh_shape_from_spec(spec, resolve)
        case PointCloudSpec():
            return PointCloud(spec.points, spec.radius)
        case HeightFieldSpec():
            return HeightField(spec.heights, spec.size, spec.floor)
        case VoxelGridSpec():
            occupancy = from_runs(spec.counts, spec.runs)
            return VoxelGrid(occupancy, spec.voxel, unknown_is_free=spec.unknown_is_free)


def _mesh_shape_from_spec(spec: ConvexSpec | MeshSpec, resolve: Callable[[str], Path]) -> Shape:
    cls = Mesh if isinstance(spec, MeshSpec) else Convex
    if spec.file is not None:
        return cls(resolve(spec.file), spec.scale)
    if isinstance(spec, MeshSpec):
        return Mesh(vertices=np.array(spec.vertices), faces=np.array(spec.faces), scale=spec.scale)
    return Convex(vertices=np.array(spec.vertices), scale=spec.scale)


def instance_from_spec(
    spec: GeometrySpec, X_PG: ArrayLike, resolve: Callable[[str], Path], *, is_seen: bool = False
) -> GeometryInstance:
    """Return the geometry with its roles at ``X_PG`` ``(4, 4)`` in its frame.

    Where the file names no roles it has the perception role if it ``is_seen`` by cameras.
    Files that its properties name are not looked for yet: see ``find_embedded_mesh`` and
    ``find_picture``.
    """
    instance = GeometryInstance(X_PG, shape_from_spec(spec.shape, resolve), spec.name)
    for role in _PROPERTIES:
        groups = getattr(spec.roles, role)
        if role == "perception":
            is_default = is_seen and "roles" not in spec.model_fields_set
            properties = perception_from_spec(groups, spec.label, spec.color, is_seen=is_default)
            if properties is not None:
                instance.set_perception_properties(properties)
        elif groups is not None:
            instance.set_properties(properties_from_spec(role, groups, spec.color))
    return instance


def perception_from_spec(
    groups: Mapping[str, Mapping[str, Any]] | None,
    label: int | None,
    color: list[float] | None = None,
    *,
    is_seen: bool,
) -> PerceptionProperties | None:
    """Return the properties of the perception role, None where there is none.

    There is one by the properties, by a ``label``, which is ("label", "id") unless the properties
    have one, or because it ``is_seen`` without either.
    """
    if groups is None and label is None and not is_seen:
        return None
    properties = properties_from_spec("perception", groups or {}, color)
    assert isinstance(properties, PerceptionProperties)
    if label is not None and not properties.has_property("label", "id"):
        properties.add_property("label", "id", label)
    return properties


def find_embedded_mesh(
    instance: GeometryInstance, role: str, resolve: Callable[[str], Path]
) -> None:
    """Replace the address of the mesh that a role embeds in a deformable geometry by its path.

    Raises SceneFileError for a missing file.
    """
    properties = instance.properties(_PROPERTIES[role].role)
    if properties is None or not properties.has_group(DEFORMABLE_GROUP):
        return
    address = properties.get_property_or_default(DEFORMABLE_GROUP, EMBEDDED_MESH, None)
    if isinstance(address, str):
        properties.update_property(DEFORMABLE_GROUP, EMBEDDED_MESH, str(resolve(address)))


def find_picture(properties: GeometryProperties | None, resolve: Callable[[str], Path]) -> None:
    """Replace the address of the picture that covers a geometry by its path.

    Raises SceneFileError for a missing file.
    """
    if properties is None:
        return
    address = properties.get_property_or_default("phong", "diffuse_map", None)
    if isinstance(address, str):
        properties.update_property("phong", "diffuse_map", str(resolve(address)))


def hydroelastic_of(
    shape: Shape, properties: ProximityProperties | None, name: str
) -> HydroelasticProperties | None:
    """Return a geometry's properties of contact surfaces, None if it has none.

    Raises PropertyError.
    """
    if properties is None or not properties.has_group(HYDROELASTIC_GROUP):
        return None
    return read_hydroelastic_properties(shape, properties, name)


def properties_from_spec(
    role: str, groups: Mapping[str, Mapping[str, Any]], color: list[float] | None
) -> GeometryProperties:
    """Return the properties of a role; ``color`` becomes ("phong", "diffuse") where one is shown.

    Three or four numbers for ("phong", "diffuse") are a colour. Whole numbers in the groups on
    contact are taken as floats, as their readers expect.
    """
    properties = _PROPERTIES[role]()
    for group, values in groups.items():
        for name, value in values.items():
            if (group, name) == ("phong", "diffuse"):
                value = Rgba.from_value(value)
            elif group in (HYDROELASTIC_GROUP, MATERIAL_GROUP) and type(value) is int:
                value = float(value)
            properties.add_property(group, name, value)
    shown = role != "proximity" and not properties.has_property("phong", "diffuse")
    if color is not None and shown:
        properties.add_property("phong", "diffuse", Rgba.from_value(color))
    return properties
