"""A grid of voxels that sensors fill: free where they see through, occupied where rays end."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.shapes.voxel_grid import VoxelGrid
from scene_graph_ros.geometry.spatial.poses import as_pose, compose, inverse
from scene_graph_ros.sensing.cloud_view import CloudView
from scene_graph_ros.sensing.depth_kernels import Lens
from scene_graph_ros.sensing.depth_view import DepthView
from scene_graph_ros.sensing.voxel_ray_kernels import (
    cast_on_face,
    LEVELS,
    mark_hits,
    mark_point_hits,
    mark_seen_through,
    take_depths,
    TILE,
)

__all__ = ["VoxelCounts", "voxels_after"]

_TANGENT = 1.125
"""Half a face's width: faces overlap, so that what is between two is wholly in one."""
_RAYS_APART = 2.0
"""A pixel's width, in distances of rays: so many that each has one where rays are regular."""
_LARGEST_FACE = 1024
"""Pixels along an edge of a face."""
_AHEAD = 1e-6
"""m before the sensor: what is nearer is not seen through."""
_FACES = [
    np.array(rows, np.float64)
    for rows in (
        [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
        [[-1, 0, 0], [0, 1, 0], [0, 0, -1]],
        [[0, 1, 0], [0, 0, 1], [1, 0, 0]],
        [[0, -1, 0], [0, 0, 1], [-1, 0, 0]],
        [[0, 0, 1], [1, 0, 0], [0, 1, 0]],
        [[0, 0, -1], [1, 0, 0], [0, -1, 0]],
    )
]
"""Rotations of the cameras that look along z, -z, x, -x, y and -y of S."""


@one_line()
class VoxelCounts(NamedTuple):
    """How many voxels a view changed."""

    freed: int
    """Those that it sees through, and that were not free."""
    hit: int
    """Those that have its points, and were not occupied."""


def voxels_after(
    occupancy: ArrayLike, voxel: float, X_WG: ArrayLike, view: DepthView | CloudView
) -> tuple[NDArray[np.uint8], VoxelCounts]:
    """Return the states ``(nx, ny, nz)`` of a grid at ``X_WG`` after a view, and its changes.

    ``voxel`` is the edge, m. A voxel becomes free if it is **wholly seen through**: all of it lies
    in view between the view's ``near`` and ``far``, and each pixel that its projection touches,
    taken as the rectangle around its corners', has a depth that is larger than that of its
    farthest corner by more than ``margin``. Pixels beside the robot have none; a ray that ends at
    the robot has come through free space. A voxel becomes occupied if the point of a pixel lies in
    it that shows no robot, within the view's region. All others stay as they are, as unknown as
    they were. So no free voxel holds a point of the image.

    The rays of a cloud are taken as six images of the same kind, the faces of a cube around the
    sensor, with pixels twice as wide as its rays are apart: of those in a pixel the one that ends
    first counts, and a pixel without a ray has no depth.

    Raises InvalidShapeError for an edge or states that a VoxelGrid refuses, and InvalidPoseError.
    """
    grid, X_WG = VoxelGrid(occupancy, voxel), as_pose(X_WG, "X_WG")
    states, rules = grid.occupancy.copy(), view.rules
    region = np.array([rules.lower, rules.upper], np.float64)
    largest = float(np.finfo(np.float32).max)
    ranges = float(rules.near), min(float(rules.far), largest)
    X_GW = np.ascontiguousarray(inverse(X_WG))
    if isinstance(view, CloudView):
        X_SG = compose(inverse(view.X_WS), X_WG)
        freed = _free_by_rays(view, ranges, X_SG, grid.voxel, states)
        hit = mark_point_hits(
            *(view.p_SPs, view.mask, ranges, view.X_WS, X_GW, region, grid.voxel, states)
        )
        return states, VoxelCounts(int(freed), int(hit))
    lens, step = view.lens, rules.step
    numbers = Lens(lens.fx, lens.fy, lens.cx, lens.cy)
    X_CG = compose(inverse(view.X_WC), X_WG)
    seen = _Depths(view.depth, view.mask, step, numbers, ranges)
    freed = _free(seen, X_CG, float(rules.margin), grid.voxel, states)
    hit = mark_hits(
        *(view.depth, view.mask, step, numbers, ranges, view.X_WC, X_GW, region),
        *(grid.voxel, states),
    )
    return states, VoxelCounts(int(freed), int(hit))


class _Depths(NamedTuple):
    """Depths ``(h, w)`` through a lens, with the mask of the blocks of ``step`` pixels squared."""

    depth: NDArray[np.float32]
    mask: NDArray[np.uint8]
    step: int
    lens: Lens
    ranges: tuple[float, float]


def _free(
    seen: _Depths,
    X_CG: NDArray[np.float64],
    margin: float,
    voxel: float,
    states: NDArray[np.uint8],
) -> int:
    """Mark voxels as free that depths see through; return how many were not."""
    height, width = seen.depth.shape
    least = np.empty((LEVELS, height, width), np.float32)
    largest = np.empty((-(-height // TILE), -(-width // TILE)), np.float32)
    take_depths(seen.depth, seen.mask, seen.step, *seen.ranges, least, largest)
    X_CG = np.ascontiguousarray(X_CG)
    return int(
        mark_seen_through(least, largest, seen.lens, X_CG, voxel, seen.ranges[0], margin, states)
    )


def _free_by_rays(
    view: CloudView,
    ranges: tuple[float, float],
    X_SG: NDArray[np.float64],
    voxel: float,
    states: NDArray[np.uint8],
) -> int:
    """Mark voxels as free that a cloud sees through, by its rays on six faces of a cube."""
    if not len(view.p_SPs):
        return 0
    side = min(math.ceil(2.0 * _TANGENT / (_RAYS_APART * view.grid.edge)), _LARGEST_FACE)
    middle, focal = 0.5 * (side - 1), 0.5 * side / _TANGENT
    lens = Lens(focal, focal, middle, middle)
    depth, freed = np.empty((side, side), np.float32), 0
    nobody = np.zeros((1, 1), np.uint8)
    for R_CS in _FACES:
        if cast_on_face(view.p_SPs, view.mask, ranges, R_CS, lens, depth):
            X_CS = np.eye(4)
            X_CS[:3, :3] = R_CS
            seen = _Depths(depth, nobody, side, lens, (_AHEAD, ranges[1]))
            freed += _free(seen, compose(X_CS, X_SG), float(view.rules.margin), voxel, states)
    return freed
