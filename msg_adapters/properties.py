"""Typed properties of geometry roles."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from msg_adapters.arrays import float64s_to_msg, int64s_to_msg
from msg_adapters.errors import MessageError
from scene_graph_msgs.msg import Property, RoleProperties
from scene_graph_ros.geometry.model.deformable import DEFORMABLE_GROUP
from scene_graph_ros.geometry.model.properties import (
    GeometryProperties,
    IllustrationProperties,
    PerceptionProperties,
    ProximityProperties,
)
from scene_graph_ros.geometry.model.rgba import Rgba
from scene_graph_ros.geometry.model.roles import Role
from scene_graph_ros.geometry.quoting import quoted

__all__ = [
    "properties_from_msg",
    "properties_to_msg",
    "property_from_msg",
    "property_to_msg",
    "resolve_files",
    "role_from_msg",
    "role_to_msg",
]

_CLASSES: dict[int, type[GeometryProperties]] = {
    RoleProperties.PROXIMITY: ProximityProperties,
    RoleProperties.ILLUSTRATION: IllustrationProperties,
    RoleProperties.PERCEPTION: PerceptionProperties,
}
_TYPE_NAMES = {
    Property.BOOL: "BOOL",
    Property.INTEGER: "INTEGER",
    Property.DOUBLE: "DOUBLE",
    Property.STRING: "STRING",
    Property.RGBA: "RGBA",
    Property.DOUBLE_ARRAY: "DOUBLE_ARRAY",
    Property.INTEGER_ARRAY: "INTEGER_ARRAY",
    Property.STRING_ARRAY: "STRING_ARRAY",
}
# Per type: the field that holds the value, and how many entries it must have (None: any number).
_FIELDS: dict[int, tuple[str, int | None]] = {
    Property.BOOL: ("integers", 1),
    Property.INTEGER: ("integers", 1),
    Property.DOUBLE: ("doubles", 1),
    Property.STRING: ("strings", 1),
    Property.RGBA: ("doubles", 4),
    Property.DOUBLE_ARRAY: ("doubles", None),
    Property.INTEGER_ARRAY: ("integers", None),
    Property.STRING_ARRAY: ("strings", None),
}


def _named(msg: Property) -> str:
    return f"property ({quoted(msg.group)}, {quoted(msg.name)})"


def role_from_msg(role: int) -> Role:
    """Return the role of a ``RoleProperties`` constant; raises MessageError for another number."""
    if role not in _CLASSES:
        raise MessageError(f"role {role} is none of 1 PROXIMITY, 2 ILLUSTRATION, 3 PERCEPTION")
    return Role(role)


def role_to_msg(role: Role) -> int:
    """Return the ``RoleProperties`` constant of a role."""
    return int(role.value)


def property_from_msg(msg: Property) -> Any:
    """Return the value of a property as bool, int, float, str, Rgba, array or tuple of str.

    Raises MessageError where the field of its type does not hold the right number of values.
    """
    if msg.type not in _FIELDS:
        raise MessageError(f"{_named(msg)} has unknown type {msg.type}")
    field, count = _FIELDS[msg.type]
    values = getattr(msg, field)
    if count is not None and len(values) != count:
        raise MessageError(
            f"{_named(msg)} of type {_TYPE_NAMES[msg.type]} takes "
            f"{count} of {field}, not {list(values)}"
        )
    if msg.type == Property.BOOL:
        if values[0] not in (0, 1):
            raise MessageError(f"{_named(msg)} is BOOL, so 0 or 1, not {values[0]}")
        return bool(values[0])
    if msg.type == Property.RGBA:
        return Rgba(*(float(channel) for channel in values))
    if msg.type == Property.DOUBLE_ARRAY:
        return np.array(values, dtype=np.float64)
    if msg.type == Property.INTEGER_ARRAY:
        return np.array(values, dtype=np.int64)
    if msg.type == Property.STRING_ARRAY:
        return tuple(values)
    return values[0]


def property_to_msg(group: str, name: str, value: Any) -> Property:
    """Return the message of one property; arrays lose their shape and keep their numbers.

    Raises MessageError for a value of a type that messages don't carry.
    """
    msg = Property(group=group, name=name)
    if isinstance(value, (bool, np.bool_)):
        msg.type, msg.integers = Property.BOOL, [int(value)]
    elif isinstance(value, (int, np.integer)):
        msg.type, msg.integers = Property.INTEGER, [int(value)]
    elif isinstance(value, (float, np.floating)):
        msg.type, msg.doubles = Property.DOUBLE, [float(value)]
    elif isinstance(value, str):
        msg.type, msg.strings = Property.STRING, [value]
    elif isinstance(value, Rgba):
        msg.type, msg.doubles = Property.RGBA, [value.r, value.g, value.b, value.a]
    elif isinstance(value, (list, tuple)) and value and all(isinstance(v, str) for v in value):
        msg.type, msg.strings = Property.STRING_ARRAY, list(value)
    else:
        _array_to_msg(msg, value)
    return msg


def _array_to_msg(msg: Property, value: Any) -> None:
    array = np.asarray(value) if isinstance(value, (list, tuple, np.ndarray)) else None
    if array is not None and array.dtype.kind in "iu":
        msg.type, msg.integers = Property.INTEGER_ARRAY, int64s_to_msg(array)
    elif array is not None and array.dtype.kind == "f":
        msg.type, msg.doubles = Property.DOUBLE_ARRAY, float64s_to_msg(array)
    else:
        raise MessageError(
            f"{_named(msg)} is a {type(value).__name__}, which messages don't carry: {value!r}"
        )


def properties_from_msg(msg: RoleProperties) -> GeometryProperties:
    """Return the properties of the role that ``msg`` names.

    Raises MessageError for an unknown role or type, PropertyError for a property given twice.
    """
    role_from_msg(msg.role)
    properties = _CLASSES[msg.role]()
    for entry in msg.properties:
        properties.add_property(entry.group, entry.name, property_from_msg(entry))
    return properties


def resolve_files(
    properties: GeometryProperties, resolve: Callable[[str], Any]
) -> None:  # fmt: skip
    """Replace the addresses of a picture and of a mesh to embed by the paths of their files."""
    picture = properties.get_property_or_default("phong", "diffuse_map", None)
    if isinstance(picture, str):
        properties.update_property("phong", "diffuse_map", str(resolve(picture)))
    if not properties.has_group(DEFORMABLE_GROUP):
        return
    from scene_graph_ros.geometry.model.driven_mesh import EMBEDDED_MESH

    address = properties.get_property_or_default(DEFORMABLE_GROUP, EMBEDDED_MESH, None)
    if isinstance(address, str):
        properties.update_property(DEFORMABLE_GROUP, EMBEDDED_MESH, str(resolve(address)))


def properties_to_msg(properties: GeometryProperties) -> RoleProperties:
    """Return the message of a role's properties, sorted by group and name."""
    entries = [
        property_to_msg(group, name, value)
        for group in sorted(properties.get_group_names())
        for name, value in sorted(properties.get_properties_in_group(group).items())
    ]
    return RoleProperties(role=role_to_msg(properties.role), properties=entries)
