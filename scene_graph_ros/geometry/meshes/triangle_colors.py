"""The colours that a mesh's file gives its triangles, read when something is to look so.

OBJ files name materials of MTL files beside them; DAE, GLB and glTF hold materials, PLY and OFF
colours of triangles or corners. Textures are not read: a material that has one has no colour.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple
import warnings

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes.cache import BuildCache
from scene_graph_ros.geometry.meshes.io import read_file
from scene_graph_ros.geometry.meshes.obj_colors import obj_materials, parse_mtl
from scene_graph_ros.geometry.meshes.scene_colors import MeshColorWarning
from scene_graph_ros.geometry.meshes.sources import file_colors, load_surface
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.shapes.mesh_shape import MeshShape

__all__ = ["TriangleColors", "triangle_colors"]

_CAPACITY = 4096


class TriangleColors(NamedTuple):
    """The colours of a mesh's triangles."""

    palette: NDArray[np.float64]
    """(k, 3) red, green and blue, 0 to 1."""
    row: NDArray[np.int32]
    """(m,) into ``palette``, in the order of ``load_surface``; -1 where the file has no colour."""


_colors: BuildCache[TriangleColors | None] = BuildCache(_CAPACITY)


def triangle_colors(shape: MeshShape) -> TriangleColors | None:
    """Return the colours of a Mesh's triangles by its file, None where it gives none.

    Warns with MeshColorWarning, once per file, where what it names is missing or wrong. Raises
    MeshError as ``load_surface`` does.
    """
    if shape.kind != ShapeKind.MESH:
        return None
    return _colors.get(shape.source_key, lambda: _read(shape))


def _read(shape: MeshShape) -> TriangleColors | None:
    if shape.file_type == "obj" and shape.path is not None:
        found = _of_obj(shape.path, len(load_surface(shape)[1]))
    else:
        found = _of_file(shape)
    return found if found is not None and (found.row >= 0).any() else None


def _warn(text: str) -> None:
    warnings.warn(MeshColorWarning(text), stacklevel=2)


def _of_obj(path: Path, count: int) -> TriangleColors | None:
    """Return the colours of ``count`` triangles."""
    contents = read_file(path)
    if b"usemtl" not in contents:
        return None
    uses = obj_materials(contents)
    if len(uses.row) != count:
        _warn(f"mesh file {str(path)!r} has changed since it was read: shown without its colours")
        return None
    known: dict[str, tuple[float, float, float]] = {}
    for library in uses.libraries:
        name = f"{str(path)!r} names the materials {library!r}"
        try:
            known |= parse_mtl(read_file(path.parent / library), name)
        except MeshError as error:
            _warn(f"{name}, shown without their colours: {error}")
    missing = sorted(set(uses.materials) - known.keys())
    if missing and uses.libraries:
        _warn(f"mesh file {str(path)!r}: no colour (Kd) of material {', '.join(missing[:5])}")
    palette = np.array([known.get(m, (0.0, 0.0, 0.0)) for m in uses.materials]).reshape(-1, 3)
    has_color = np.array([*(m in known for m in uses.materials), False])
    return TriangleColors(palette, np.where(has_color[uses.row], uses.row, np.int32(-1)))


def _of_file(shape: MeshShape) -> TriangleColors | None:
    rows = file_colors(shape)
    if rows is None:
        return None
    is_known = ~np.isnan(rows[:, 0])
    palette, inverse = np.unique(rows[is_known], axis=0, return_inverse=True)
    index = np.full(len(rows), -1, np.int32)
    index[is_known] = inverse.reshape(-1)
    return TriangleColors(palette, index)
