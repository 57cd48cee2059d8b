"""Calls that compile the kernels of maps of voxels: octrees read and written, and other grids."""

from __future__ import annotations

import numpy as np

from scene_graph_ros.geometry.perception.camera import CameraIntrinsics
from scene_graph_ros.sensing import CloudView, DepthRules, DepthView, voxels_after
from scene_graph_ros.sensing.octree_stream import MIDDLE, OctreeStream
from scene_graph_ros.sensing.octree_writing import binary_octree, full_octree
from scene_graph_ros.sensing.voxel_resampling import resampled_states

__all__ = ["read_maps"]


def read_maps() -> None:
    """Write one voxel as both kinds of octrees, read them, see it in grids and views."""
    occupancy, first = np.ones((1, 1, 1), np.uint8), np.full(3, MIDDLE, np.int64)
    for write in (binary_octree, full_octree):
        stream = OctreeStream(write(occupancy, first), is_binary=write is binary_octree)
        states = stream.states(*stream.extent())
        resampled_states(states, (1.0, 1.0, 1.0), np.diag([-1.0, -1.0, 1.0, 1.0]), (1, 1, 1), 0.5)
    lens = CameraIntrinsics(8, 8, 8.0, 8.0, 3.5, 3.5)
    view = DepthView.of(np.full((8, 8), 1.0, np.float32), lens, np.eye(4), DepthRules())
    voxels_after(occupancy, 0.1, np.eye(4), view)
    cloud = CloudView.of(view.p_CPs.reshape(-1, 3), np.eye(4), DepthRules())
    voxels_after(occupancy, 0.1, np.eye(4), cloud)
