"""Geometry before its registration: a shape, where it is, its name and its roles."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import InvalidShapeError, RoleError
from scene_graph_ros.geometry.model.ids import GeometryId
from scene_graph_ros.geometry.model.names import canonical_name
from scene_graph_ros.geometry.model.properties import (
    GeometryProperties,
    IllustrationProperties,
    PerceptionProperties,
    ProximityProperties,
)
from scene_graph_ros.geometry.model.roles import checked_role, Role
from scene_graph_ros.geometry.one_line import cut
from scene_graph_ros.geometry.shapes.shape import Shape
from scene_graph_ros.geometry.spatial.poses import as_pose

__all__ = ["GeometryInstance", "checked_properties", "checked_shape"]


def checked_shape(shape: Any, name: str) -> Shape:
    """Return ``shape``. Raises InvalidShapeError, naming the geometry, if it is not a Shape."""
    if not isinstance(shape, Shape):
        raise InvalidShapeError(f"geometry {name!r} needs a shape, not {shape!r}")
    return shape


def checked_properties(properties: Any) -> GeometryProperties:
    """Return ``properties``. Raises RoleError if they belong to no role."""
    if not isinstance(properties, GeometryProperties) or properties.role is Role.UNASSIGNED:
        raise RoleError(
            "a role needs ProximityProperties, IllustrationProperties or PerceptionProperties,"
            f" not {properties!r}"
        )
    return properties


class GeometryInstance:
    """A shape with its pose ``X_PG`` in its parent P, a name, and properties for its roles.

    The parent is a frame or another geometry; it is named at registration.
    """

    __slots__ = ("_X_PG", "_id", "_name", "_properties", "_shape")

    def __init__(self, X_PG: Any, shape: Shape, name: str) -> None:
        """Raise InvalidPoseError, InvalidShapeError or NameConflictError for bad arguments.

        ``X_PG`` is ``(4, 4)``, in m.
        """
        self._name = canonical_name("geometry", name)
        self._shape = checked_shape(shape, self._name)
        self._id = GeometryId.get_new_id()
        self._properties: dict[Role, GeometryProperties] = {}
        self.set_pose(X_PG)

    def id(self) -> GeometryId:
        """Return the id that the geometry will keep when it is registered."""
        return self._id

    def name(self) -> str:
        """Return the name, without blanks at its ends."""
        return self._name

    def set_name(self, name: str) -> None:
        """Set the name. Raises NameConflictError if it is empty or blank."""
        self._name = canonical_name("geometry", name)

    def pose(self) -> NDArray[np.float64]:
        """Return ``X_PG`` ``(4, 4)``, read-only."""
        return self._X_PG

    def set_pose(self, X_PG: Any) -> None:
        """Set ``X_PG``. Raises InvalidPoseError if it is not rigid and finite."""
        self._X_PG = as_pose(X_PG, f"X_PG of geometry {self._name!r}")

    def shape(self) -> Shape:
        """Return the shape."""
        return self._shape

    def set_shape(self, shape: Shape) -> None:
        """Set the shape."""
        self._shape = checked_shape(shape, self._name)

    def properties(self, role: Role) -> GeometryProperties | None:
        """Return the properties for a role, which may be changed, or None."""
        return self._properties.get(checked_role(role))

    def set_properties(self, properties: GeometryProperties) -> None:
        """Store a copy of properties for the role they belong to."""
        properties = checked_properties(properties)
        self._properties[properties.role] = properties.copy()

    def proximity_properties(self) -> ProximityProperties | None:
        """Return the proximity properties or None."""
        return self._properties.get(Role.PROXIMITY)  # type: ignore[return-value]

    def illustration_properties(self) -> IllustrationProperties | None:
        """Return the illustration properties or None."""
        return self._properties.get(Role.ILLUSTRATION)  # type: ignore[return-value]

    def perception_properties(self) -> PerceptionProperties | None:
        """Return the perception properties or None."""
        return self._properties.get(Role.PERCEPTION)  # type: ignore[return-value]

    # What these return belongs to the instance and may be changed until it is registered.
    mutable_proximity_properties = proximity_properties
    mutable_illustration_properties = illustration_properties
    mutable_perception_properties = perception_properties

    def set_proximity_properties(self, properties: ProximityProperties) -> None:
        """Store a copy: the geometry will get the proximity role when it is registered."""
        self._set(properties, Role.PROXIMITY)

    def set_illustration_properties(self, properties: IllustrationProperties) -> None:
        """Store a copy: the geometry will get the illustration role when it is registered."""
        self._set(properties, Role.ILLUSTRATION)

    def set_perception_properties(self, properties: PerceptionProperties) -> None:
        """Store a copy: the geometry will get the perception role when it is registered."""
        self._set(properties, Role.PERCEPTION)

    def _set(self, properties: Any, role: Role) -> None:
        if checked_properties(properties).role is not role:
            raise RoleError(
                f"geometry {self._name!r}: {type(properties).__name__} are not for {role.name}"
            )
        self.set_properties(properties)

    def __repr__(self) -> str:
        roles = "".join(f", {role.name}" for role in self._properties)
        return cut(f"GeometryInstance({self._name!r}, {self._shape!r}{roles})")
