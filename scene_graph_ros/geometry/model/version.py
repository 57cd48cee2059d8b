"""Tokens that tell whether a role's geometry has changed."""

from __future__ import annotations

from dataclasses import dataclass

from scene_graph_ros.geometry.errors import RoleError
from scene_graph_ros.geometry.model.roles import checked_role, Role

__all__ = ["GeometryVersion"]


@dataclass(frozen=True, slots=True)
class GeometryVersion:
    """One number per role. Equal numbers mean that nothing about the role's geometry changed.

    Contexts keep the numbers of the model they come from until either changes.
    """

    proximity: int
    illustration: int
    perception: int

    def is_same_as(self, other: GeometryVersion, role: Role) -> bool:
        """Tell whether a role's geometry is the same. Raises RoleError for UNASSIGNED."""
        if checked_role(role) is Role.UNASSIGNED:
            raise RoleError(f"there is no version of geometry for role {role.name}")
        name = role.name.lower()
        return bool(getattr(self, name) == getattr(other, name))
