"""The sides of paddings, frames or geometries, and the geometries that these mean."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any, TypeAlias

from scene_graph_ros.geometry.model.ids import FrameId, GeometryId
from scene_graph_ros.geometry.model.roles import Role

__all__ = ["PaddedSide", "geometry_paddings"]

PaddedSide: TypeAlias = FrameId | GeometryId | None
"""All geometry on a frame, one geometry, or None: everything."""


def geometry_paddings(
    paddings: Mapping[tuple[PaddedSide, PaddedSide], float], inspector: Any
) -> list[tuple[Collection[GeometryId] | None, Collection[GeometryId] | None, float]]:
    """Return the geometries of both sides of each pair, None for all, and the padding (m).

    More exact names come later, and of equal ones the newest.
    """
    ordered = sorted(paddings.items(), key=lambda item: sum(map(_exactness, item[0])))
    return [
        (_geometries(a, inspector), _geometries(b, inspector), value) for (a, b), value in ordered
    ]


def _exactness(side: PaddedSide) -> int:
    return 0 if side is None else 1 if isinstance(side, FrameId) else 2


def _geometries(side: PaddedSide, inspector: Any) -> Collection[GeometryId] | None:
    if side is None:
        return None
    if isinstance(side, GeometryId):
        return (side,)
    found: Collection[GeometryId] = inspector.get_geometries(side, Role.PROXIMITY)
    return found
