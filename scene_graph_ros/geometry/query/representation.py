"""How the faces of a contact surface are given."""

from __future__ import annotations

import enum
from typing import Any

from scene_graph_ros.geometry.errors import QueryArgumentError

__all__ = ["ContactRepresentation", "as_representation"]


class ContactRepresentation(enum.StrEnum):
    """The form of a contact surface's faces; each is as good as its word."""

    TRIANGLE = "triangle"
    """Triangles: each polygon with more than three corners is divided about its centroid."""
    POLYGON = "polygon"
    """Convex polygons of three to eight corners, one per pair of elements that meet."""


def as_representation(value: Any) -> ContactRepresentation:
    """Return the representation that ``value`` names. Raises QueryArgumentError if none."""
    try:
        return ContactRepresentation(value)
    except ValueError:
        words = " or ".join(repr(member.value) for member in ContactRepresentation)
        raise QueryArgumentError(f"representation must be {words}, not {value!r}") from None
