"""Shapes of many elements, which a sensor keeps changing: the elements are state, as poses are."""

from __future__ import annotations

import enum

from scene_graph_ros.geometry.shapes.shape import Shape

__all__ = ["ElementKind", "ElementShape"]


class ElementKind(enum.IntEnum):
    """The kind of a shape's elements. The pairs that `ShapeKind` names know none of them."""

    POINT_CLOUD = 100
    """Balls around points."""
    HEIGHT_FIELD = 101
    """Prisms below the triangles of a grid of heights."""
    VOXEL_GRID = 102
    """Boxes of a grid."""


class ElementShape(Shape):
    """The union of many elements. Queries answer with the one that is nearest, or deepest.

    The shape has the elements to begin with; a context has those of now.
    """

    __slots__ = ()
