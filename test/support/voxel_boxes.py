"""The voxels of grids, each as a box of its own."""

import numpy as np

from scene_graph_ros.geometry import Box


def boxes_of(shape, occupancy=None):
    """Return (center, box about it) of each solid voxel, and their indices as elements."""
    solid = shape.is_solid(shape.occupancy if occupancy is None else occupancy)
    centers = (np.argwhere(solid) + 0.5) * shape.voxel
    box = Box(shape.voxel, shape.voxel, shape.voxel)
    return [(center, box) for center in centers], np.flatnonzero(solid.reshape(-1))
