"""Images of depth, and clouds, as points with radii: self filter, clearing, decay. No ROS here.

`DepthView` is one image at a pose, `CloudView` one cloud; `SelfFilter` marks the pixels and points
that show a robot or its load, and `SeenPoints` remembers earlier points until a later view sees
through them. `voxels_after` keeps a grid of voxels in the same way: free, occupied, or unknown.
"""

from scene_graph_ros.sensing.cloud_view import CloudView
from scene_graph_ros.sensing.depth_view import DepthRules, DepthView, NewPoints
from scene_graph_ros.sensing.seen_points import Counts, SeenPoints
from scene_graph_ros.sensing.seen_voxels import SeenVoxels, VoxelsSeen
from scene_graph_ros.sensing.self_filter import Body, SelfFilter
from scene_graph_ros.sensing.voxel_map import VoxelCounts, voxels_after

__all__ = [
    "Body",
    "CloudView",
    "Counts",
    "DepthRules",
    "DepthView",
    "NewPoints",
    "SeenPoints",
    "SeenVoxels",
    "SelfFilter",
    "VoxelCounts",
    "VoxelsSeen",
    "voxels_after",
]
