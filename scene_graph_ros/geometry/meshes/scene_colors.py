"""Colours and pictures of triangles in trimesh's scenes: of materials, triangles, corners."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.meshes.color_warnings import warn_of_color
from scene_graph_ros.geometry.meshes.file_pictures import FilePicture, FilePictures
from scene_graph_ros.geometry.quoting import quoted

__all__ = ["scene_colors", "scene_pictures"]


def scene_colors(scene: Any, name: str) -> NDArray[np.float64] | None:
    """Return red, green and blue (m, 3), 0 to 1, of the triangles of all bodies in their order.

    NaN where there is none, None where there are none at all. A triangle whose corners have
    colours has their mean. None as well, with a MeshColorWarning, where the colours of the mesh
    called ``name`` make no sense.
    """
    bodies = (scene.geometry[scene.graph[node][1]] for node in scene.graph.nodes_geometry)
    try:
        colors = np.concatenate([np.zeros((0, 3)), *map(_of_body, bodies)])
    except Exception as error:  # noqa: BLE001 - trimesh takes colours as they are
        warn_of_color(f"{name}: shown without its colours, which are unreadable: {quoted(error)}")
        return None
    return None if np.isnan(colors).all() else colors


def _of_body(body: Any) -> NDArray[np.float64]:
    count = len(getattr(body, "faces", ()))
    result = np.full((count, 3), np.nan)
    visual = getattr(body, "visual", None)
    if not count or visual is None:
        return result
    if visual.kind in ("face", "vertex"):
        result[:] = np.asarray(visual.face_colors)[:, :3] / 255.0
    elif visual.kind == "texture":
        color = _of_material(visual.material)
        if color is not None:
            result[:] = color
    return result


def _of_material(material: Any) -> NDArray[np.float64] | None:
    factor = getattr(material, "baseColorFactor", None)
    if factor is None:
        factor = getattr(material, "diffuse", None)
    if factor is None:
        return None
    color: NDArray[np.float64] = np.asarray(factor, np.float64)[:3] / 255.0
    return color


def scene_pictures(scene: Any, by_name: Mapping[str, FilePicture]) -> FilePictures | None:
    """Return the pictures of the triangles of all bodies in their order; None without any.

    They are found ``by_name`` of the material.
    """
    numbers: dict[FilePicture, int] = {}
    rows = [np.zeros(0, np.int32)]
    for node in scene.graph.nodes_geometry:
        body = scene.geometry[scene.graph[node][1]]
        material = getattr(getattr(body, "visual", None), "material", None)
        picture = by_name.get(getattr(material, "name", None) or "")
        row = -1 if picture is None else numbers.setdefault(picture, len(numbers))
        rows.append(np.full(len(getattr(body, "faces", ())), row, np.int32))
    return FilePictures(tuple(numbers), np.concatenate(rows)) if numbers else None
