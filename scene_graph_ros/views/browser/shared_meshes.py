"""The meshes that pages are sent, and the pictures on them: made once for all that look alike."""

from __future__ import annotations

from collections.abc import Hashable
import itertools
from typing import NamedTuple

import numpy as np

from scene_graph_ros.geometry.errors import SceneGraphError
from scene_graph_ros.views.browser.blocks import mesh_block, texture_block
from scene_graph_ros.views.draw_list import DrawItem
from scene_graph_ros.views.looks import paint_of, triangles_of
from scene_graph_ros.views.png import png
from scene_graph_ros.views.skins import picture_on, Skin, skin_of, SkinPicture

__all__ = ["MOST_TEXELS", "SharedMesh", "SharedMeshes", "SharedTexture"]

MOST_TEXELS = 1024
"""Along a side of a picture that pages get; larger ones are thinned out."""


class SharedTexture(NamedTuple):
    """A picture that pages get."""

    name: str
    number: int
    block: bytes
    is_opaque: bool


class SharedMesh(NamedTuple):
    """A mesh that pages get."""

    number: int
    block: bytes
    """Empty where it can't be shown, and why not:"""
    reason: str = ""
    is_painted: bool = False
    textures: tuple[SharedTexture, ...] = ()


class SharedMeshes:
    """Blocks of triangles and of pictures, numbered from 1 each.

    Those that no scene has asked for between two calls of ``forget_old`` are forgotten.
    """

    def __init__(self) -> None:
        """Know none."""
        self._numbers = itertools.count(1)
        self._texture_numbers = itertools.count(1)
        self._new: dict[Hashable, SharedMesh] = {}
        self._old: dict[Hashable, SharedMesh] = {}
        self._new_textures: dict[str, SharedTexture] = {}
        self._old_textures: dict[str, SharedTexture] = {}

    def forget_old(self) -> None:
        """Begin anew to note the meshes in use."""
        self._old, self._new = self._new, {}
        self._old_textures, self._new_textures = self._new_textures, {}

    def of(self, item: DrawItem) -> SharedMesh:
        """Return the mesh of an item: of one that has a picture, or whose form is ``mesh``."""
        # With what its file says, if no colour and no picture is given for all of it.
        key = (
            item.shape,
            item.is_as_given,
            item.rgba is None,
            item.picture and (item.picture, item.rgba),
        )
        mesh = self._new.get(key) or self._old.get(key) or self._make(item)
        self._new[key] = mesh
        for texture in mesh.textures:
            self._new_textures[texture.name] = texture
        return mesh

    def texture(self, picture: SkinPicture) -> SharedTexture:
        """Return a picture as pages get it."""
        known = self._new_textures.get(picture.name) or self._old_textures.get(picture.name)
        if known is None:
            number = next(self._texture_numbers)
            levels = picture.texels[..., :3] if picture.is_opaque else picture.texels
            block = texture_block(number, png(_thinned(levels)))
            known = SharedTexture(picture.name, number, block, picture.is_opaque)
        self._new_textures[picture.name] = known
        return known

    def texture_of_plane(self, item: DrawItem) -> SharedTexture | None:
        """Return the picture on a half space, None without one."""
        return None if item.picture is None else self.texture(picture_on(item.picture))

    def _make(self, item: DrawItem) -> SharedMesh:
        number = next(self._numbers)
        try:
            skin = skin_of(item)
            if skin is not None:
                return self._with_skin(number, skin)
            mesh, paint = triangles_of(item), paint_of(item)
        except SceneGraphError as error:
            return SharedMesh(number, b"", str(error))
        return SharedMesh(number, mesh_block(number, *mesh, paint), is_painted=paint is not None)

    def _with_skin(self, number: int, skin: Skin) -> SharedMesh:
        textures = tuple(self.texture(picture) for picture in skin.pictures)
        numbers = np.array([*(texture.number for texture in textures), 0], np.uint32)[skin.row]
        # Those of one picture stand together, and are drawn at once.
        order = np.argsort(numbers, kind="stable")
        vertices, triangles = skin.mesh
        block = mesh_block(
            number,
            vertices,
            triangles[order],
            skin.paint[order],
            textures=numbers[order],
            coordinates=skin.coordinates[order],
            normals=() if skin.normals is None else skin.normals[order],
        )
        return SharedMesh(number, block, is_painted=True, textures=textures)


def _thinned(levels: np.ndarray) -> np.ndarray:
    """Return a picture of MOST_TEXELS along a side at most, each the mean of some."""
    factor = -(-max(levels.shape[:2]) // MOST_TEXELS)
    if factor == 1:
        return levels
    from PIL import Image  # it has read the picture

    return np.asarray(Image.fromarray(np.ascontiguousarray(levels)).reduce(factor))
