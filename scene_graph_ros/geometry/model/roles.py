"""The roles of a geometry."""

import enum
from typing import Any

from scene_graph_ros.geometry.errors import RoleError

__all__ = ["Role", "RoleAssign", "checked_role"]


class Role(enum.Enum):
    """The uses of a geometry. A geometry may have several roles, or none yet."""

    UNASSIGNED = 0
    """No role: known to the model, ignored by every query."""
    PROXIMITY = 1
    """Takes part in collision, distance and contact queries."""
    ILLUSTRATION = 2
    """Is drawn for people."""
    PERCEPTION = 3
    """Is seen by simulated cameras."""

    __hash__ = object.__hash__  # there is one object of each; Enum's own is a function in Python


class RoleAssign(enum.Enum):
    """The effect of assigning a role on properties that are there already."""

    NEW = 0
    """The geometry must not have the role yet."""
    REPLACE = 1
    """The geometry must have the role; all its properties are replaced."""


def checked_role(role: Any) -> Role:
    """Return ``role``. Raises RoleError for anything else, such as the name of one."""
    if not isinstance(role, Role):
        raise RoleError(f"a role is Role.PROXIMITY or another of Role, not {role!r}")
    return role
