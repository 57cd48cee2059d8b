"""Pictures and transparency of the bodies that a renderer draws, as arrays: for its kernels."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.meshes.cache import BuildCache
from scene_graph_ros.geometry.meshes.sources import source_identity
from scene_graph_ros.geometry.meshes.texture_coordinates import texture_coordinates
from scene_graph_ros.geometry.meshes.textures import known_texture, Texture
from scene_graph_ros.geometry.model.perception_properties import Appearance
from scene_graph_ros.geometry.model.records import GeometryRecord
from scene_graph_ros.geometry.shapes.mesh_shape import MeshShape

__all__ = ["Cover", "cover_of"]


class Cover(NamedTuple):
    """Alpha of n bodies, and the pictures on them; arrays of 0 rows where there is none at all."""

    alpha: np.ndarray
    """(n,) from 0, as if it were not there, to 1."""
    is_transparent: np.ndarray
    """(n,) bool: whether something behind a body may be seen through it."""
    picture: np.ndarray
    """(n,) int32: the picture on each body, or -1."""
    repeats: np.ndarray
    """(n, 2): factors of the texture coordinates."""
    first: np.ndarray
    """(n,) int64: the row in ``corners`` of the first triangle of a body's mesh."""
    corners: np.ndarray
    """(T, 3, 2): (u, v) at the corners of triangles."""
    size: np.ndarray
    """(k, 2) int64: width and height of each picture."""
    start: np.ndarray
    """(k,) int64: the row in ``texels`` of its upper left corner."""
    texels: np.ndarray
    """(N, 4) uint8: red, green, blue and alpha, row by row from above."""


_texels: BuildCache[NDArray[np.uint8]] = BuildCache(4)


def cover_of(
    records: Sequence[GeometryRecord], looks: Sequence[Appearance], alpha: NDArray[np.float64]
) -> Cover:
    """Return what covers the bodies of these records, whose appearances are ``looks``.

    ``alpha`` (n,) is that of their own colours.
    """
    n = len(records)
    is_transparent = alpha < 1.0
    picture, first = np.full(n, -1, np.int32), np.zeros(n, np.int64)
    repeats = np.ones((n, 2))
    textures: dict[str, Texture] = {}
    numbers: dict[str, int] = {}
    tables: dict[Hashable, tuple[int, NDArray[np.float64]]] = {}
    count = 0
    for row, (record, look) in enumerate(zip(records, looks, strict=True)):
        if look.picture is None:
            continue
        path = look.picture.path
        textures.setdefault(path, known_texture(path))
        is_transparent[row] |= not textures[path].is_opaque
        picture[row] = numbers.setdefault(path, len(numbers))
        repeats[row] = look.picture.scale
        if isinstance(record.shape, MeshShape):
            identity = source_identity(record.shape)
            if identity not in tables:
                tables[identity] = (count, texture_coordinates(record.shape))
                count += len(tables[identity][1])
            first[row] = tables[identity][0]
    lengths = [texture.texels.size // 4 for texture in textures.values()]
    sizes = [texture.texels.shape[1::-1] for texture in textures.values()]
    return Cover(
        alpha=alpha,
        is_transparent=is_transparent,
        picture=picture,
        repeats=repeats,
        first=first,
        corners=np.concatenate([np.zeros((0, 3, 2)), *(table for _, table in tables.values())]),
        size=np.array(sizes, np.int64).reshape(-1, 2),
        start=np.cumsum([0, *lengths], dtype=np.int64)[:-1],
        texels=_joined(tuple(textures.values())),
    )


def _joined(textures: tuple[Texture, ...]) -> NDArray[np.uint8]:
    """Return the texels of all pictures; the same ones are joined once."""
    if len(textures) == 1:
        return textures[0].texels.reshape(-1, 4)

    def join() -> NDArray[np.uint8]:
        parts = [texture.texels.reshape(-1, 4) for texture in textures]
        return np.concatenate([np.zeros((0, 4), np.uint8), *parts])

    return _texels.get(tuple((texture.name, texture.stamp) for texture in textures), join)
