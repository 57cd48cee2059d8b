"""Clouds as bodies that renderers draw: a sphere for each of their balls."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.model.point_set import PointSet
from scene_graph_ros.geometry.perception.exact.bodies import Bodies
from scene_graph_ros.geometry.perception.exact.cover import Cover
from scene_graph_ros.geometry.spatial.sums import moved

__all__ = ["taken", "with_balls"]

_OF_BODIES = (
    "kind", "size", "X_WG", "center", "radius", "mesh", "label", "diffuse", "is_painted",
)  # fmt: skip
_OF_COVER = ("alpha", "is_transparent", "repeats", "picture", "first")


def taken(bodies: Bodies, cover: Cover, rows: NDArray[np.int64]) -> tuple[Bodies, Cover]:
    """Return some rows, new arrays of them; shared parts are those of the former."""
    return (
        bodies._replace(**{name: getattr(bodies, name)[rows] for name in _OF_BODIES}),
        cover._replace(**{name: getattr(cover, name)[rows] for name in _OF_COVER}),
    )


def with_balls(
    bodies: Bodies,
    cover: Cover,
    points: Mapping[int, PointSet],
    poses: Mapping[int, NDArray[np.float64]],
) -> tuple[Bodies, Cover]:
    """Return the same with a sphere for each ball of the clouds in some rows, ``X_WG`` by row."""
    counts = np.ones(len(bodies.kind), np.int64)
    for row, each in points.items():
        counts[row] = each.count
    result, covered = taken(bodies, cover, np.repeat(np.arange(len(counts)), counts))
    ends = np.cumsum(counts)
    for row, each in points.items():
        balls, X_WG = slice(ends[row] - counts[row], ends[row]), poses[row]
        result.X_WG[balls, :3, 3] = moved(each.points, X_WG)
        result.size[balls, 0] = result.radius[balls] = each.radii
    return result, covered
