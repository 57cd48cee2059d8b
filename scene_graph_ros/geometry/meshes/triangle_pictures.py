"""The pictures that a mesh's file gives its triangles, read when something is to look so.

OBJ files name materials of MTL files, which name pictures (``map_Kd``), relative to themselves;
DAE and glTF files name pictures beside them, GLB and glTF files may hold some. A mesh from memory
has those alone that it holds: a client's mesh names no files.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import NamedTuple
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.files import find_file
from scene_graph_ros.geometry.meshes.cache import BuildCache
from scene_graph_ros.geometry.meshes.color_warnings import warn_of_color
from scene_graph_ros.geometry.meshes.file_pictures import FilePicture, FilePictures
from scene_graph_ros.geometry.meshes.obj_look import obj_look
from scene_graph_ros.geometry.meshes.sources import file_pictures
from scene_graph_ros.geometry.meshes.texture_coordinates import coordinates_of_file
from scene_graph_ros.geometry.meshes.textures import MAX_TEXELS, picture_texture, PictureFile
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.shapes.mesh_shape import MeshShape

__all__ = ["TrianglePictures", "triangle_pictures"]

_CAPACITY = 4096


class TrianglePictures(NamedTuple):
    """The pictures on a mesh's triangles. Alpha in their files is passed over."""

    pictures: tuple[PictureFile, ...]
    row: NDArray[np.int32]
    """(m,) into ``pictures``, in the order of ``load_surface``; -1 for none."""
    coordinates: NDArray[np.float64]
    """(m, 3, 2): (u, v) at the corners of triangles, v upwards; 0 where there is no picture."""


_pictures: BuildCache[TrianglePictures | None] = BuildCache(_CAPACITY)


def triangle_pictures(shape: MeshShape) -> TrianglePictures | None:
    """Return the pictures on a Mesh's triangles by its file, None where it gives none.

    Warns with MeshColorWarning, once per file, of those that are missing, unreadable or too large,
    and of triangles that lack coordinates: they are shown without. Raises MeshError as
    ``load_surface`` does.
    """
    if shape.kind != ShapeKind.MESH:
        return None
    found = _pictures.get(shape.source_key, lambda: _read(shape))
    if found is None or np.prod(shape.scale) > 0.0:
        return found
    # A mirroring scale turns the corners round, see load_surface.
    return found._replace(coordinates=found.coordinates[:, ::-1])


def _read(shape: MeshShape) -> TrianglePictures | None:
    told = _of_obj(shape) if shape.file_type == "obj" else file_pictures(shape)
    if told is None:
        return None
    name = f"mesh file {str(shape.path)!r}" if shape.path is not None else f"{shape!r}"
    files = _readable(told.pictures, shape.path, name)
    numbers: dict[PictureFile, int] = {}
    index = [-1 if file is None else numbers.setdefault(file, len(numbers)) for file in files]
    row = np.array([*index, -1], np.int32)[told.row]
    if not numbers:
        return None
    try:
        corners = coordinates_of_file(shape)
    except MeshError as error:
        warn_of_color(f"{name}: shown without its pictures: {error}")
        return None
    lacking = (row >= 0) & ~np.isfinite(corners).all(axis=(1, 2))
    if lacking.any():
        warn_of_color(
            f"{name}: {int(lacking.sum())} triangles, from {int(lacking.argmax())} on, have a"
            " picture and no texture coordinates: shown without"
        )
    row[lacking] = -1
    if not (row >= 0).any():
        return None
    return TrianglePictures(tuple(numbers), row, _placed(corners, told, row))


def _of_obj(shape: MeshShape) -> FilePictures | None:
    look = obj_look(shape)
    if look is None:
        return None
    pictures = [(k, m.picture) for k, m in enumerate(look.materials) if m.picture is not None]
    if not pictures:
        return None
    index = np.full(len(look.materials) + 1, -1, np.int32)
    index[[k for k, _ in pictures]] = np.arange(len(pictures))
    return FilePictures(tuple(picture for _, picture in pictures), index[look.row])


def _readable(
    pictures: tuple[FilePicture, ...], mesh: Path | None, name: str
) -> list[PictureFile | None]:
    """Return the files of pictures, None for unreadable ones, and for all after too many."""
    result: list[PictureFile | None] = []
    known: dict[PictureFile, str | None] = {}
    left = MAX_TEXELS
    for picture in pictures:
        if picture.contents is not None:
            file = PictureFile(f"{picture.address} of {name}", picture.contents)
        elif mesh is None:
            result.append(None)
            continue
        else:
            file = PictureFile(_place(picture.address, mesh.parent / picture.folder))
        if file not in known:
            known[file] = None
            try:
                if left <= 0:
                    raise MeshError(f"the pictures before it have more than {MAX_TEXELS} pixels")
                left -= picture_texture(file).texels.size // 4
                if left < 0:
                    raise MeshError(f"with those before it, it has more than {MAX_TEXELS} pixels")
            except MeshError as error:
                known[file] = str(error)
                warn_of_color(f"{name} names {quoted(picture.address)}, shown without: {error}")
        result.append(file if known[file] is None else None)
    return result


def _place(address: str, folder: Path) -> str:
    """Return the absolute path of a picture: written as a path, also of Windows, or as a URI."""
    text = address.strip().removeprefix("file://").replace("\\", "/")
    plain = os.path.normpath(folder / text)
    if "%" in text:
        try:
            find_file(plain)
        except OSError:
            return os.path.normpath(folder / unquote(text))
    return plain


def _placed(
    corners: NDArray[np.float64], told: FilePictures, row: NDArray[np.int32]
) -> NDArray[np.float64]:
    """Return coordinates where materials put them, 0 for triangles without a picture."""
    placements = np.array([picture.placement for picture in told.pictures])
    result = np.zeros_like(corners)
    shown = row >= 0
    matrix = placements[told.row[shown]]
    result[shown] = np.einsum("tij,tkj->tki", matrix[..., :2], corners[shown])
    result[shown] += matrix[:, None, :, 2]
    return result
