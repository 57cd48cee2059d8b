"""A grid of voxels that images of depth fill: free where they see through, occupied where not."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.shapes.voxel_grid import VoxelGrid
from scene_graph_ros.geometry.spatial.poses import as_pose, compose, inverse
from scene_graph_ros.sensing.depth_kernels import Lens
from scene_graph_ros.sensing.depth_view import DepthView
from scene_graph_ros.sensing.voxel_ray_kernels import (
    LEVELS,
    mark_hits,
    mark_seen_through,
    take_depths,
    TILE,
)

__all__ = ["VoxelCounts", "voxels_after"]


@one_line()
class VoxelCounts(NamedTuple):
    """How many voxels an image changed."""

    freed: int
    """Those that it sees through, and that were not free."""
    hit: int
    """Those that have its points, and were not occupied."""


def voxels_after(
    occupancy: ArrayLike, voxel: float, X_WG: ArrayLike, view: DepthView
) -> tuple[NDArray[np.uint8], VoxelCounts]:
    """Return the states ``(nx, ny, nz)`` of a grid at ``X_WG`` after an image, and its changes.

    ``voxel`` is the edge, m. A voxel becomes free if it is **wholly seen through**: all of it lies
    in view between the view's ``near`` and ``far``, and each pixel that its projection touches,
    taken as the rectangle around its corners', has a depth that is larger than that of its
    farthest corner by more than ``margin``. Pixels beside the robot have none; a ray that ends at
    the robot has come through free space. A voxel becomes occupied if the point of a pixel lies in
    it that shows no robot, within the view's region. All others stay as they are, as unknown as
    they were. So no free voxel holds a point of the image.

    Raises InvalidShapeError for an edge or states that a VoxelGrid refuses, and InvalidPoseError.
    """
    grid, X_WG = VoxelGrid(occupancy, voxel), as_pose(X_WG, "X_WG")
    voxel = grid.voxel
    depth, rules, lens = view.depth, view.rules, view.lens
    numbers = Lens(lens.fx, lens.fy, lens.cx, lens.cy)
    height, width = depth.shape
    least = np.empty((LEVELS, height, width), np.float32)
    largest = np.empty((-(-height // TILE), -(-width // TILE)), np.float32)
    near, far = float(rules.near), min(float(rules.far), float(np.finfo(np.float32).max))
    take_depths(depth, view.mask, rules.step, near, far, least, largest)
    states = grid.occupancy.copy()
    X_CG = np.ascontiguousarray(compose(inverse(view.X_WC), X_WG))
    freed = mark_seen_through(
        least, largest, numbers, X_CG, voxel, near, float(rules.margin), states
    )
    region = np.array([rules.lower, rules.upper], np.float64)
    hit = mark_hits(
        *(depth, view.mask, rules.step, numbers, (near, far), view.X_WC),
        *(np.ascontiguousarray(inverse(X_WG)), region, voxel, states),
    )
    return states, VoxelCounts(int(freed), int(hit))
