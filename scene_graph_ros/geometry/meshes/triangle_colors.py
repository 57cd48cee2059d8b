"""The colours that a mesh's file gives its triangles, read when something is to look so.

OBJ files name materials of MTL files beside them; DAE, GLB and glTF hold materials, PLY and OFF
colours of triangles or corners. Triangles with a picture and no colour are white, as below any
picture.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.meshes.cache import BuildCache
from scene_graph_ros.geometry.meshes.obj_look import obj_look, ObjLook
from scene_graph_ros.geometry.meshes.sources import file_colors
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

    Warns with MeshColorWarning, once per file, where a file that it names is missing or wrong.
    Raises MeshError as ``load_surface`` does.
    """
    if shape.kind != ShapeKind.MESH:
        return None
    return _colors.get(shape.source_key, lambda: _read(shape))


def _read(shape: MeshShape) -> TriangleColors | None:
    if shape.file_type == "obj":
        look = obj_look(shape)
        found = None if look is None else _of_look(look)
    else:
        found = _of_file(shape)
    return found if found is not None and (found.row >= 0).any() else None


def _of_look(look: ObjLook) -> TriangleColors:
    shown = [(1.0, 1.0, 1.0) if m.picture and not m.color else m.color for m in look.materials]
    palette = np.array([color or (0.0, 0.0, 0.0) for color in shown]).reshape(-1, 3)
    has_color = np.array([*(color is not None for color in shown), False])
    return TriangleColors(palette, np.where(has_color[look.row], look.row, np.int32(-1)))


def _of_file(shape: MeshShape) -> TriangleColors | None:
    rows = file_colors(shape)
    if rows is None:
        return None
    is_known = ~np.isnan(rows[:, 0])
    palette, inverse = np.unique(rows[is_known], axis=0, return_inverse=True)
    index = np.full(len(rows), -1, np.int32)
    index[is_known] = inverse.reshape(-1)
    return TriangleColors(palette, index)
