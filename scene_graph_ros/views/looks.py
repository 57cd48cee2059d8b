"""An item's look in viewers that have forms of their own: a form and its size."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple
import warnings

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.meshes.color_warnings import MeshColorWarning
from scene_graph_ros.geometry.meshes.triangle_colors import triangle_colors
from scene_graph_ros.geometry.shapes.every_kind import every_kind
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.shapes.mesh_shape import MeshShape
from scene_graph_ros.views.draw_list import DrawItem
from scene_graph_ros.views.items import DEFAULT_COLOR
from scene_graph_ros.views.triangles import hull_triangles, surface_triangles, Triangles

__all__ = ["Look", "look_of", "paint_of", "triangles_of"]

Size = tuple[float, float, float]


class Look(NamedTuple):
    """A form around the origin of the shape's frame G, stretched along the axes of G.

    ``ellipsoid``: half axes. ``box``: lengths of the edges. ``cylinder``, ``capsule``: the radius
    twice, and the length along z, of a capsule without its caps. ``half_space``: below z = 0, of
    no size. ``mesh``: triangles, which have their size; see ``triangles_of``. Metres.
    """

    form: str
    size: Size


_OF_KINDS: dict[ShapeKind, Callable[[Any], Look]] = {
    ShapeKind.SPHERE: lambda s: Look("ellipsoid", (s.radius, s.radius, s.radius)),
    ShapeKind.ELLIPSOID: lambda s: Look("ellipsoid", (s.a, s.b, s.c)),
    ShapeKind.BOX: lambda s: Look("box", (s.width, s.depth, s.height)),
    ShapeKind.CYLINDER: lambda s: Look("cylinder", (s.radius, s.radius, s.length)),
    ShapeKind.CAPSULE: lambda s: Look("capsule", (s.radius, s.radius, s.length)),
    ShapeKind.HALF_SPACE: lambda s: Look("half_space", (0.0, 0.0, 0.0)),
    ShapeKind.CONVEX: lambda s: Look("mesh", (1.0, 1.0, 1.0)),
    ShapeKind.MESH: lambda s: Look("mesh", (1.0, 1.0, 1.0)),
}
_LOOKS = every_kind("looks", _OF_KINDS)


def look_of(item: DrawItem) -> Look:
    """Return the form of an item, and its size."""
    return _LOOKS[item.shape.kind](item.shape)


def triangles_of(item: DrawItem) -> Triangles:
    """Return the triangles of an item whose form is ``mesh``, in G, its scale applied.

    Raises MeshError or InvalidShapeError where the mesh can't be read.
    """
    shape = item.shape
    assert isinstance(shape, MeshShape), shape
    return surface_triangles(shape) if item.is_as_given else hull_triangles(shape)


def paint_of(item: DrawItem) -> NDArray[np.uint8] | None:
    """Return red, green and blue ``(t, 3)`` of the triangles of an item whose form is ``mesh``.

    None where it has one colour: one that was given, below a picture too, or no material in its
    file. Triangles without a material have DEFAULT_COLOR. Raises MeshError where the mesh can't be
    read.
    """
    shape = item.shape
    assert isinstance(shape, MeshShape), shape
    if item.rgba is not None or item.picture is not None or not item.is_as_given:
        return None
    with warnings.catch_warnings():
        # Who renders it says so; the page shows what there is.
        warnings.simplefilter("ignore", MeshColorWarning)
        colors = triangle_colors(shape)
    if colors is None:
        return None
    default = [(DEFAULT_COLOR.r, DEFAULT_COLOR.g, DEFAULT_COLOR.b)]
    palette = np.concatenate([colors.palette, default])
    return np.rint(255.0 * np.clip(palette, 0.0, 1.0)[colors.row]).astype(np.uint8)
