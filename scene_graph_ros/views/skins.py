"""The pictures on items: those of their properties, or of their meshes' files."""

from __future__ import annotations

from typing import NamedTuple
import warnings

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.meshes.color_warnings import MeshColorWarning
from scene_graph_ros.geometry.meshes.sources import load_surface
from scene_graph_ros.geometry.meshes.texture_coordinates import texture_coordinates
from scene_graph_ros.geometry.meshes.textures import known_texture, picture_texture, Texture
from scene_graph_ros.geometry.meshes.triangle_pictures import triangle_pictures
from scene_graph_ros.geometry.model.perception_properties import Picture
from scene_graph_ros.geometry.model.rgba import Rgba
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.shapes.mesh_shape import MeshShape
from scene_graph_ros.views.draw_list import DrawItem
from scene_graph_ros.views.looks import look_of, paint_of
from scene_graph_ros.views.triangles import Triangles

__all__ = ["Skin", "SkinPicture", "picture_on", "skin_of"]

_WHITE = Rgba(1.0, 1.0, 1.0, 1.0)


class SkinPicture(NamedTuple):
    """A picture as it is shown."""

    name: str
    """What tells it from others, with what follows from a change of its file."""
    texels: NDArray[np.uint8]
    """``(height, width, 4)`` red, green, blue and alpha, from the upper row down."""
    is_opaque: bool
    """Whether alpha does not count."""


class Skin(NamedTuple):
    """Triangles of an item, in G, and the pictures on them."""

    mesh: Triangles
    paint: NDArray[np.uint8]
    """``(t, 3)`` red, green and blue, with which pictures are multiplied."""
    pictures: tuple[SkinPicture, ...]
    row: NDArray[np.int32]
    """``(t,)`` into ``pictures``; -1 for none."""
    coordinates: NDArray[np.float64]
    """``(t, 3, 2)``: (u, v) at the corners, v upwards; pictures repeat themselves."""
    normals: NDArray[np.float64] | None = None
    """``(t, 3, 3)`` at the corners, in G; None: those of the triangles."""


def skin_of(item: DrawItem) -> Skin | None:
    """Return the triangles of an item that has pictures, None for one without.

    A half space has no triangles, and so no skin: see ``picture_on``. Raises MeshError where a
    mesh or a picture can't be read.
    """
    shape = item.shape
    if shape.kind == ShapeKind.HALF_SPACE or item.as_hull:
        return None
    if item.picture is not None:
        return _of_property(item, item.picture)
    if item.rgba is not None or not isinstance(shape, MeshShape) or not item.is_as_given:
        return None
    with warnings.catch_warnings():
        # Who renders it says so; the page shows what there is.
        warnings.simplefilter("ignore", MeshColorWarning)
        found = triangle_pictures(shape)
    paint = paint_of(item)
    if found is None or paint is None:
        return None
    # What the files of meshes say of alpha is passed over.
    pictures = tuple(_shown(picture_texture(file), has_alpha=False) for file in found.pictures)
    mesh = Triangles(*load_surface(shape))
    return Skin(mesh, paint, pictures, found.row, found.coordinates)


def picture_on(picture: Picture) -> SkinPicture:
    """Return the picture that a property names. Raises MeshError."""
    return _shown(known_texture(picture.path), has_alpha=True)


def _shown(texture: Texture, *, has_alpha: bool) -> SkinPicture:
    is_opaque = texture.is_opaque or not has_alpha
    kind = "opaque" if is_opaque else "with alpha"
    return SkinPicture(f"{texture.name} {texture.stamp} {kind}", texture.texels, is_opaque)


def _of_property(item: DrawItem, picture: Picture) -> Skin:
    shape, normals = item.shape, None
    if isinstance(shape, MeshShape):
        mesh, coordinates = Triangles(*load_surface(shape)), texture_coordinates(shape)
    else:
        mesh, coordinates, normals = _of_form(item)
    count = len(mesh.triangles)
    color = item.rgba or _WHITE
    levels = np.rint(255.0 * np.array((color.r, color.g, color.b))).astype(np.uint8)
    return Skin(
        mesh,
        np.tile(levels, (count, 1)),
        (picture_on(picture),),
        np.zeros(count, np.int32),
        coordinates * picture.scale,
        normals,
    )


def _of_form(item: DrawItem) -> tuple[Triangles, NDArray[np.float64], NDArray[np.float64]]:
    """Return triangles of a shape with a closed form, where they are on its picture, and normals.

    Both are of the corners.
    """
    # Scenes without such a picture need nothing of cameras.
    from scene_graph_ros.geometry.perception.surfaces import patch_of_shape

    form, (a, b, c) = look_of(item)
    kind, size = {
        "ellipsoid": (ShapeKind.ELLIPSOID, (a, b, c)),
        "box": (ShapeKind.BOX, (0.5 * a, 0.5 * b, 0.5 * c)),
        "cylinder": (ShapeKind.CYLINDER, (a, 0.5 * c, 0.0)),
        "capsule": (ShapeKind.CAPSULE, (a, 0.5 * c, 0.0)),
    }[form]
    patch = patch_of_shape(int(kind), np.array(size), 0.0, np.zeros(3))
    mesh = Triangles(patch.vertices, patch.triangles)
    assert patch.uv is not None  # as all shapes with a closed form have
    assert patch.normals is not None  # the same
    return mesh, patch.uv[patch.triangles], patch.normals[patch.triangles]
