"""Bodies of contact surfaces, made before the world is changed.

To fill a mesh with tetrahedra can take seconds. Done here, outside the world's lock, it stops
nobody; the core keeps the bodies, and a request for one that can't be made is refused.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from msg_adapters.names import SceneNames
from msg_adapters.properties import properties_from_msg
from msg_adapters.scene import instance_from_msg
from scene_graph_ros.geometry.model.contact_properties import HYDROELASTIC_GROUP
from scene_graph_ros.geometry.model.hydroelastic_properties import read_hydroelastic_properties
from scene_graph_ros.geometry.shapes.shape import Shape

__all__ = ["prepare"]


def _make_body(shape: Shape, properties: Any, name: str) -> None:
    """Make the body that a compliant geometry needs for contact surfaces.

    ``properties`` are those of the proximity role, or None. Raises PropertyError or MeshError.
    """
    if properties is None or not properties.has_group(HYDROELASTIC_GROUP):
        return
    hydroelastic = read_hydroelastic_properties(shape, properties, name)
    # Rigid surfaces are simple, and without a compliant partner they are not needed.
    if hydroelastic is not None and hydroelastic.is_compliant:
        from scene_graph_ros.geometry.hydroelastic.bodies import body_of

        body_of(shape, hydroelastic)


def _has_group(role: Any) -> bool:
    return role.role == role.PROXIMITY and any(
        entry.group == HYDROELASTIC_GROUP for entry in role.properties
    )


def _of_descriptions(request: Any, names: SceneNames, inspector: Any, resolve: Any) -> None:
    for description in request.geometries:
        if any(_has_group(role) for role in description.roles):
            instance = instance_from_msg(description, resolve)
            _make_body(instance.shape(), instance.proximity_properties(), instance.name())


def _of_role(request: Any, names: SceneNames, inspector: Any, resolve: Any) -> None:
    if not _has_group(request.role):
        return
    properties = properties_from_msg(request.role)
    for geometry_id in [names.geometry_id(reference) for reference in request.geometries]:
        if not inspector.is_deformable(geometry_id):
            shape, name = inspector.get_shape(geometry_id), inspector.get_name(geometry_id)
            _make_body(shape, properties, name)


_PREPARATIONS: dict[str, Callable[[Any, SceneNames, Any, Any], None]] = {
    "AssignRole": _of_role,
    "RegisterAnchoredGeometry": _of_descriptions,
    "RegisterGeometry": _of_descriptions,
}


def prepare(
    name: str, request: Any, names: SceneNames, inspector: Any, resolve: Callable[[str], Any]
) -> None:
    """Make the bodies that a request of type ``name`` will need.

    Raises the errors of registering, and MeshError for a shape that has no body.
    """
    preparation = _PREPARATIONS.get(name)
    if preparation is not None:
        preparation(request, names, inspector, resolve)
