"""Convex regions of the world to messages and back; imported when one is first asked for."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from geometry_msgs.msg import Point
import numpy as np
from numpy.typing import NDArray

from msg_adapters.arrays import (
    float64s_to_msg,
    int64s_to_msg,
    rows_from_msg,
    uint8s_to_msg,
    uint64s_to_msg,
)
from msg_adapters.errors import MessageError
from msg_adapters.names import legend, SceneNames
from msg_adapters.poses import header_to_msg
from scene_graph_msgs.msg import Region, RegionArray, RegionCutTable
from scene_graph_ros.geometry.optimization import HPolyhedron, RegionCut
from scene_graph_ros.geometry.tolerances import MAX_COORDINATE

__all__ = [
    "outcome_of",
    "point_from_msg",
    "region_array_to_msg",
    "region_cuts_to_msg",
    "region_from_msg",
    "region_to_msg",
]


def point_from_msg(msg: Point, field: str) -> NDArray[np.float64]:
    """Return a point ``(3,)``, metres; raises MessageError for one that no scene has."""
    p = np.array([msg.x, msg.y, msg.z], dtype=np.float64)
    for axis, value in zip("xyz", p.tolist(), strict=True):
        if not abs(value) <= MAX_COORDINATE:
            raise MessageError(
                f"{field}.{axis} must be a number up to {MAX_COORDINATE:g}, not {value}"
            )
    return p


def region_from_msg(
    a: Sequence[float], b: Sequence[float], field_a: str, field_b: str
) -> HPolyhedron:
    """Return the polyhedron with these faces; raises MessageError for faces of none.

    Normals and sides must be numbers up to the largest coordinate; a normal of 0 is no face.
    """
    normals, sides = rows_from_msg(a, 3, field_a), np.array(b, dtype=np.float64)
    if len(normals) != len(sides):
        raise MessageError(
            f"{field_a} has {len(normals)} normals, {field_b} has {len(sides)} right sides"
        )
    for k, (normal, side) in enumerate(zip(normals.tolist(), sides.tolist(), strict=True)):
        if not 0.0 < max(map(abs, normal)) <= MAX_COORDINATE:
            raise MessageError(
                f"{field_a}: normal {k} must not be 0 and have numbers up to"
                f" {MAX_COORDINATE:g}, not {normal}"
            )
        if not abs(side) <= MAX_COORDINATE * max(map(abs, normal)):
            raise MessageError(
                f"{field_b}[{k}] must be a number up to {MAX_COORDINATE:g} times its normal's"
                f" length, not {side}"
            )
    return HPolyhedron(normals.reshape(-1, 3), sides)


def region_to_msg(name: str, region: HPolyhedron) -> Region:
    """Return a region of three dimensions."""
    return Region(name=name, a=float64s_to_msg(region.A.ravel()), b=float64s_to_msg(region.b))


def outcome_of(cuts: Iterable[RegionCut]) -> int:
    """Return the outcome of a region from the obstacles in it."""
    proven = [cut.is_proven for cut in cuts]
    if not proven:
        return int(RegionArray.FREE)
    return int(RegionArray.CUT if any(proven) else RegionArray.UNDECIDED)


def region_cuts_to_msg(
    cuts_of_rows: Sequence[Sequence[RegionCut]], names: SceneNames | None
) -> RegionCutTable:
    """Return the obstacles in regions, row by row; without ``names`` the legend stays empty."""
    cuts = [cut for row in cuts_of_rows for cut in row]
    ids = np.array([int(cut.geometry_id) for cut in cuts], dtype=np.int64)
    points = np.array([cut.point for cut in cuts]).reshape(-1)
    return RegionCutTable(
        row=uint64s_to_msg([k for k, row in enumerate(cuts_of_rows) for _ in row]),
        id=int64s_to_msg(ids),
        depth=float64s_to_msg([cut.depth for cut in cuts]),
        points=float64s_to_msg(points),
        is_proven=uint8s_to_msg([cut.is_proven for cut in cuts]),
        geometries=legend(names, ids),
    )


def region_array_to_msg(
    regions: Mapping[str, tuple[HPolyhedron, Sequence[RegionCut]]],
    names: SceneNames,
    *,
    stamp_ns: int,
    frame_id: str,
    scene_version: int,
) -> RegionArray:
    """Return regions by name, with the obstacles in each."""
    ordered: list[tuple[str, Any]] = sorted(regions.items())
    return RegionArray(
        header=header_to_msg(stamp_ns, frame_id),
        scene_version=scene_version,
        regions=[region_to_msg(name, region) for name, (region, _) in ordered],
        outcomes=uint8s_to_msg([outcome_of(cuts) for _, (_, cuts) in ordered]),
        cuts=region_cuts_to_msg([cuts for _, (_, cuts) in ordered], names),
    )
