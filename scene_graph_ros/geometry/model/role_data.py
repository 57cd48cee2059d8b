"""The files of roles, read before a model is locked for a change."""

from __future__ import annotations

from collections.abc import Callable

from scene_graph_ros.geometry.model.perception_properties import (
    check_appearance,
    check_illustration,
)
from scene_graph_ros.geometry.model.properties import GeometryProperties, ProximityProperties
from scene_graph_ros.geometry.model.proximity import read_mesh_data
from scene_graph_ros.geometry.model.records import GeometryRecord
from scene_graph_ros.geometry.model.reference_meshes import read_embedded_meshes
from scene_graph_ros.geometry.model.roles import Role
from scene_graph_ros.geometry.shapes.shape import Shape

__all__ = ["read_for_role", "read_looks"]


def read_for_role(record: GeometryRecord, properties: GeometryProperties) -> None:
    """Read the files of a geometry for the role that properties stand for.

    Raises MeshError and PropertyError.
    """
    deforms = record.deformable is not None
    # Whoever gives something else is told when it is assigned.
    of_role = {getattr(properties, "role", Role.UNASSIGNED): properties}
    read_looks(record.shape, of_role.get, record.name, deforms=deforms)
    if deforms:
        read_embedded_meshes([properties])
    elif isinstance(properties, ProximityProperties):
        read_mesh_data(record.shape, properties, record.name)


def read_looks(
    shape: Shape,
    properties_of: Callable[[Role], GeometryProperties | None],
    name: str,
    *,
    deforms: bool = False,
) -> None:
    """Read the looks for cameras and people. Raises MeshError and PropertyError."""
    for role, check in (
        (Role.PERCEPTION, check_appearance),
        (Role.ILLUSTRATION, check_illustration),
    ):
        properties = properties_of(role)
        if properties is not None:
            check(shape, properties, name, deforms=deforms)
