"""Parts that cross, fold or nest themselves, which the library would unite wrongly.

Where a part winds around points by -1, inside of another one, they are wound around not at all:
the solid has a hollow there. A union of the two has none.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.meshes.solids.cavities import may_have_cavities, Part
from scene_graph_ros.geometry.meshes.solids.cut import (
    cut_where_they_cross,
    NotUnitedError,
    self_crossing,
    used_part,
)
from scene_graph_ros.geometry.meshes.solids.mesh_report import Repair
from scene_graph_ros.geometry.meshes.solids.parts import signed_volumes

__all__ = ["WithoutFolds", "crossing_parts", "without_folds"]

FloatArray = NDArray[np.float64]


def crossing_parts(points: FloatArray, members: list[Part]) -> dict[int, FloatArray | None]:
    """Return the parts over (v, 3) points that wind otherwise than once, and a place, if known."""
    result: dict[int, FloatArray | None] = {}
    for k, part in enumerate(members):
        at = self_crossing(points, part.triangles)
        if at is not None:
            result[k] = at
        elif part.is_nested:
            result[k] = None
    return result


class WithoutFolds(NamedTuple):
    """Parts of which some were cut where they lie on themselves."""

    points: FloatArray
    """(v, 3)."""
    members: list[Part]
    """Without those that bound nothing."""
    repairs: list[Repair]
    doubt: str
    """Why some of it may be wrong, or nothing."""


def without_folds(
    points: FloatArray, members: list[Part], chosen: Mapping[int, FloatArray]
) -> WithoutFolds:
    """Cut the chosen ones of parts over (v, 3) points alone; places (3,) are reported.

    A part that can't be cut stays as it is. A region around which one winds by -1, or twice, is
    lost; where another part is there, the solid is in doubt.
    """
    at, result, count = [points], [], len(points)
    repairs: list[Repair] = []
    doubt = ""
    for k, part in enumerate(members):
        if k not in chosen:
            result.append(part)
            continue
        own, triangles = used_part(points, part.triangles)
        try:
            cut = cut_where_they_cross(
                own, triangles, np.zeros(len(own), dtype=np.int64), chosen[k]
            )
        except NotUnitedError:
            result.append(part)
            continue
        lost = [cut.negative, cut.multiple] if may_have_cavities(members) else [cut.negative]
        if _meet(np.concatenate(lost), [*members[:k], *members[k + 1 :]]):
            doubt = "a part that is folded and turned inside out overlaps another one"
        piece = cut.piece
        repairs += piece.repairs
        if not len(piece.triangles):
            continue
        one = np.zeros(len(piece.triangles), dtype=np.int64)
        volume = float(signed_volumes(piece.vertices, piece.triangles, one, 1)[0]) / 6.0
        triangles = piece.triangles + count
        result.append(
            part._replace(
                triangles=triangles, volume=volume, has_edges_of_two=False, is_nested=False
            )
        )
        at.append(piece.vertices)
        count += len(piece.vertices)
    return WithoutFolds(np.concatenate(at), result, repairs, doubt)


def _meet(boxes: FloatArray, parts: list[Part]) -> bool:
    """Tell whether any of (r, 2, 3) boxes meets the box of a part."""
    lower = np.array([part.lower for part in parts])
    upper = np.array([part.upper for part in parts])
    meets = (boxes[:, None, 0] <= upper) & (boxes[:, None, 1] >= lower)
    return bool(meets.all(axis=2).any())
