"""Cameras that requests describe."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from msg_adapters.errors import MessageError
from msg_adapters.poses import pose_from_msg
from scene_graph_msgs.msg import CameraDescription
from scene_graph_ros.geometry.perception import (
    CameraIntrinsics,
    ClippingRange,
    DepthRange,
    DepthRenderCamera,
    RenderCameraCore,
)

__all__ = ["camera_from_msg"]


def camera_from_msg(
    msg: CameraDescription, renderer: str
) -> tuple[DepthRenderCamera, NDArray[np.float64]]:
    """Return the camera that a renderer is asked about, and its pose ``X_PC`` in ``msg.frame``.

    Raises QueryArgumentError for numbers that no camera has, MessageError where an angle of view
    and a lens are both given, and InvalidPoseError for a pose that is not rigid and finite.
    """
    lens = (msg.fx, msg.fy, msg.cx, msg.cy)
    if msg.fov_y != 0.0 and not any(lens):
        intrinsics = CameraIntrinsics.from_fov_y(msg.width, msg.height, msg.fov_y)
    elif msg.fov_y == 0.0:
        intrinsics = CameraIntrinsics(msg.width, msg.height, *lens)
    else:
        raise MessageError(
            f"description: give fov_y or the lens, not both: fov_y is {msg.fov_y}, and fx, fy, cx,"
            f" cy are {lens}"
        )
    clipping = ClippingRange(msg.clipping_near, msg.clipping_far)
    if msg.depth_min == 0.0 and msg.depth_max == 0.0:
        depth_range = DepthRange(clipping.near, clipping.far)
    else:
        depth_range = DepthRange(msg.depth_min, msg.depth_max)
    core = RenderCameraCore(renderer, intrinsics, clipping)
    return DepthRenderCamera(core, depth_range), pose_from_msg(msg.pose, "description.pose")
