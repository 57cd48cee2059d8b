"""Drawings of deformable geometry: its driven meshes, whose vertices move."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import SceneGraphError
from scene_graph_ros.geometry.model.ids import GeometryId
from scene_graph_ros.geometry.model.inspector import SceneGraphInspector
from scene_graph_ros.geometry.model.roles import Role
from scene_graph_ros.views.draw_list import DrawItem
from scene_graph_ros.views.items import draw_items

__all__ = ["DeformableItem", "deformable_items"]


class DeformableItem(NamedTuple):
    """A deformable geometry to draw."""

    item: DrawItem
    triangles: NDArray[np.int64]
    """(t, 3) of its driven mesh."""


def deformable_items(
    inspector: SceneGraphInspector,
    role: Role,
    geometry_ids: Iterable[GeometryId],
    cannot_show: Callable[[int, Exception], None],
) -> list[DeformableItem]:
    """Return the drawings of deformable geometries with ``role``.

    One whose driven mesh can't be had is left out, and ``cannot_show`` called with its id and why.
    """
    ids = list(geometry_ids)
    result = []
    for geometry_id, item in zip(ids, draw_items(inspector, role, ids), strict=True):
        try:
            (surface,) = inspector.get_driven_meshes(geometry_id, role)
        except SceneGraphError as error:
            cannot_show(int(geometry_id), error)
            continue
        result.append(DeformableItem(item, surface.triangles))
    return result
