"""Closed parts, oriented about the solid and pressed together where they touch."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.meshes.solids.cavities import (
    Cavities,
    cavities_among,
    may_have_cavities,
    Part,
)
from scene_graph_ros.geometry.meshes.solids.folds import first_fold
from scene_graph_ros.geometry.meshes.solids.manifolds import bodies_of
from scene_graph_ros.geometry.meshes.solids.press import Pressed, pressed_together

__all__ = ["PressedParts", "folds_at", "pressed_parts"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


class PressedParts(NamedTuple):
    """The triangles of parts and where their vertices are once faces that touch overlap."""

    triangles: IntArray
    """(m, 3): oriented by the volume of each part."""
    oriented: IntArray
    """(m, 3): the same, turned where they are of cavities."""
    of: IntArray
    """(v,): the part that each vertex is a corner of, or -1."""
    cavities: Cavities
    pressed: Pressed


def pressed_parts(points: FloatArray, members: list[Part], tolerance: float) -> PressedParts:
    """Find the cavities of parts over (v, 3) points, and press together what touches.

    Slits that are not wider than the tolerance, metres, are closed.
    """
    label = np.repeat(np.arange(len(members)), [len(part.triangles) for part in members])
    triangles = np.concatenate([part.triangles for part in members])
    of = np.full(len(points), -1)
    of[triangles] = label[:, None]
    cavities = Cavities([-1] * len(members), [], [])
    if may_have_cavities(members):
        cavities = cavities_among(points, members, bodies_of(points, members), tolerance)
    cavity_of = np.array(cavities.of)
    hollow = cavity_of >= 0
    oriented = np.where(hollow[label][:, None], triangles[:, ::-1], triangles)
    pressed = pressed_together(points, oriented, label, cavity_of, tolerance)
    return PressedParts(triangles, oriented, of, cavities, pressed)


def folds_at(
    points: FloatArray, members: list[Part], found: PressedParts
) -> dict[int, FloatArray]:
    """Return the parts that lie on themselves and have vertices that pressing moved, and where.

    Pressing opens a fold, or overlaps it, by as little as it moves, and then no search finds it.
    """
    is_moved = (found.pressed.vertices != points).any(axis=1) & (found.of >= 0)
    result: dict[int, FloatArray] = {}
    for k in np.unique(found.of[is_moved]).tolist():
        at = first_fold(points, members[k].triangles)
        if at is not None:
            result[k] = at
    return result
