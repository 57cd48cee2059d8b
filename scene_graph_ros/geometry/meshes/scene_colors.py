"""The colours of triangles in what trimesh has read: of materials, triangles or corners."""

from __future__ import annotations

from typing import Any
import warnings

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.quoting import quoted

__all__ = ["MeshColorWarning", "scene_colors"]


class MeshColorWarning(UserWarning):
    """Colours that a mesh's file promises can't be read: it is shown without them."""


def scene_colors(scene: Any, name: str) -> NDArray[np.float64] | None:
    """Return red, green and blue (m, 3), 0 to 1, of the triangles of all bodies in their order.

    NaN where there is none, None where there are none at all. A triangle whose corners have
    colours has their mean. A material that has a texture has no colour here. None as well,
    with a MeshColorWarning, where the colours of the mesh called ``name`` make no sense.
    """
    bodies = (scene.geometry[scene.graph[node][1]] for node in scene.graph.nodes_geometry)
    try:
        colors = np.concatenate([np.zeros((0, 3)), *map(_of_body, bodies)])
    except Exception as error:  # noqa: BLE001 - trimesh takes colours as they are
        text = f"{name}: shown without its colours, which are unreadable: {quoted(error)}"
        warnings.warn(MeshColorWarning(text), stacklevel=2)
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
    has_texture = any(
        getattr(material, name, None) is not None for name in ("baseColorTexture", "image")
    )
    factor = getattr(material, "baseColorFactor", None)
    if factor is None:
        factor = getattr(material, "diffuse", None)
    if has_texture or factor is None:
        return None
    color: NDArray[np.float64] = np.asarray(factor, np.float64)[:3] / 255.0
    return color
