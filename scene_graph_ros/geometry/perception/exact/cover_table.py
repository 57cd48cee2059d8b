"""Gather the pictures and the transparency of the bodies that a renderer draws."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.meshes.cache import BuildCache
from scene_graph_ros.geometry.meshes.sources import source_identity
from scene_graph_ros.geometry.meshes.texture_coordinates import texture_coordinates
from scene_graph_ros.geometry.meshes.textures import known_texture, picture_texture, Texture
from scene_graph_ros.geometry.meshes.triangle_pictures import triangle_pictures
from scene_graph_ros.geometry.model.perception_properties import Appearance
from scene_graph_ros.geometry.model.records import GeometryRecord
from scene_graph_ros.geometry.perception.exact.cover import BY_TRIANGLE, Cover
from scene_graph_ros.geometry.shapes.mesh_shape import MeshShape

__all__ = ["cover_of"]

_Part = tuple[NDArray[np.float64], NDArray[np.int32]]
"""Coordinates and pictures of a mesh's triangles."""

_texels: BuildCache[NDArray[np.uint8]] = BuildCache(4)


class _Pictures:
    """The pictures of all bodies, each with a number, and where meshes' triangles are on them."""

    def __init__(self) -> None:
        self.textures: list[tuple[Texture, bool]] = []
        """Each with whether its alpha counts."""
        self.parts: list[_Part] = []
        self._numbers: dict[Hashable, int] = {}
        self._starts: dict[Hashable, int] = {}
        self._count = 0

    def number(self, texture: Texture, *, has_alpha: bool) -> int:
        has_alpha = has_alpha or texture.is_opaque
        key = (texture.name, has_alpha)
        if key not in self._numbers:
            self._numbers[key] = len(self.textures)
            self.textures.append((texture, has_alpha))
        return self._numbers[key]

    def start(self, key: Hashable, make: Callable[[], _Part]) -> int:
        """Return the first row of a mesh's triangles, made where they are not there yet."""
        if key not in self._starts:
            part = make()
            self._starts[key] = self._count
            self._count += len(part[0])
            self.parts.append(part)
        return self._starts[key]


def cover_of(
    records: Sequence[GeometryRecord], looks: Sequence[Appearance], alpha: NDArray[np.float64]
) -> Cover:
    """Return the covers of the bodies of these records, whose appearances are ``looks``.

    ``alpha`` (n,) is that of their own colours.
    """
    n = len(records)
    is_transparent = alpha < 1.0
    picture, first = np.full(n, -1, np.int32), np.zeros(n, np.int64)
    repeats = np.ones((n, 2))
    pictures = _Pictures()
    for row, (record, look) in enumerate(zip(records, looks, strict=True)):
        shape = record.shape
        if look.picture is not None:
            texture = known_texture(look.picture.path)
            is_transparent[row] |= not texture.is_opaque
            picture[row] = pictures.number(texture, has_alpha=True)
            repeats[row] = look.picture.scale
            if isinstance(shape, MeshShape):
                first[row] = _start_of_own(pictures, shape)
        elif look.is_of_file and record.deformable is None and isinstance(shape, MeshShape):
            start = _start_of_file(pictures, shape)
            if start is not None:
                picture[row], first[row] = BY_TRIANGLE, start
    sizes = [texture.texels.shape[1::-1] for texture, _ in pictures.textures]
    lengths = [width * height for width, height in sizes]
    return Cover(
        alpha=alpha,
        is_transparent=is_transparent,
        picture=picture,
        repeats=repeats,
        first=first,
        corners=np.concatenate([np.zeros((0, 3, 2)), *(part[0] for part in pictures.parts)]),
        of_triangle=np.concatenate([np.zeros(0, np.int32), *(p[1] for p in pictures.parts)]),
        size=np.array(sizes, np.int64).reshape(-1, 2),
        start=np.cumsum([0, *lengths], dtype=np.int64)[:-1],
        texels=_joined(pictures.textures),
    )


def _start_of_own(pictures: _Pictures, shape: MeshShape) -> int:
    """Return the first row of the triangles of a mesh that has a picture of its own."""

    def make() -> _Part:
        corners = texture_coordinates(shape)
        return corners, np.full(len(corners), -1, np.int32)

    return pictures.start((source_identity(shape), False), make)


def _start_of_file(pictures: _Pictures, shape: MeshShape) -> int | None:
    """Return the first row of the triangles of a mesh whose file gives pictures; None if not."""
    found = triangle_pictures(shape)
    if found is None:
        return None

    def make() -> _Part:
        numbers = [
            pictures.number(picture_texture(file), has_alpha=False) for file in found.pictures
        ]
        return found.coordinates, np.array([*numbers, -1], np.int32)[found.row]

    return pictures.start((source_identity(shape), True), make)


def _joined(textures: Sequence[tuple[Texture, bool]]) -> NDArray[np.uint8]:
    """Return the texels of all pictures; the same ones are joined once."""
    if len(textures) == 1 and textures[0][1]:
        return textures[0][0].texels.reshape(-1, 4)

    def join() -> NDArray[np.uint8]:
        parts = [texture.texels.reshape(-1, 4) for texture, _ in textures]
        result = np.concatenate([np.zeros((0, 4), np.uint8), *parts])
        start = 0
        for part, (_, has_alpha) in zip(parts, textures, strict=True):
            if not has_alpha:
                result[start : start + len(part), 3] = 255
            start += len(part)
        result.setflags(write=False)  # as a picture's own: of one type to the compiler
        return result

    key = tuple((texture.name, texture.stamp, has_alpha) for texture, has_alpha in textures)
    return _texels.get(key, join)
