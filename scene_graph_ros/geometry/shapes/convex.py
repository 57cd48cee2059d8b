"""The convex hull of points."""

from __future__ import annotations

from typing import ClassVar

from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.shapes.mesh_shape import MeshShape

__all__ = ["Convex"]


class Convex(MeshShape):
    """The convex hull of a file's vertices, or of points ``vertices=`` ``(n, 3)``.

    ``Convex(path, scale=1.0)``, ``Convex(vertices=points)`` or
    ``Convex(contents=data, file_type="obj")``. ``scale`` is a number or three; it may be negative.
    """

    __slots__ = ()
    kind: ClassVar[ShapeKind] = ShapeKind.CONVEX
