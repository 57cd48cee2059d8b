"""Cameras that requests describe or register, and cameras of the scene back to messages."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from msg_adapters.errors import MessageError
from msg_adapters.poses import pose_from_msg, pose_to_msg
import scene_graph_msgs.msg
from scene_graph_msgs.msg import SceneCamera, SceneCameraInfo
from scene_graph_ros.geometry.errors import SceneGraphError
from scene_graph_ros.geometry.perception import (
    CameraDescription,
    CameraIntrinsics,
    CameraOutput,
    ClippingRange,
    DepthRange,
    DepthRenderCamera,
    RenderCameraCore,
)
from scene_graph_ros.geometry.quoting import quoted

__all__ = ["camera_from_msg", "scene_camera_from_msg", "scene_camera_to_msg"]


def camera_from_msg(
    msg: scene_graph_msgs.msg.CameraDescription, renderer: str
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


def scene_camera_from_msg(msg: SceneCamera, source: str, renderer: str) -> CameraDescription:
    """Return the camera of ``source`` to register; whether it has the frame is not looked at.

    Nor is whether there is the renderer that it names, ``renderer`` if it names none.

    Raises MessageError, naming the camera, for a lens, ranges and a pose that no camera has, and
    the errors of CameraDescription.
    """
    try:
        camera, X_PC = camera_from_msg(msg.description, msg.renderer or renderer)
    except SceneGraphError as error:
        raise MessageError(f"camera {quoted(msg.name)}: {error}") from error
    frame = msg.description.frame or "world"
    outputs: frozenset[CameraOutput] = frozenset(msg.images)  # checked by the description
    return CameraDescription(msg.name, source, frame, X_PC, camera, outputs, msg.rate)


def scene_camera_to_msg(camera: CameraDescription) -> SceneCameraInfo:
    """Return the description of a camera; registering it again makes the same."""
    core, depth_range = camera.camera.core, camera.camera.depth_range
    lens, clipping = core.intrinsics, core.clipping
    return SceneCameraInfo(
        source=camera.source,
        camera=SceneCamera(
            name=camera.name,
            description=scene_graph_msgs.msg.CameraDescription(
                frame=camera.frame,
                pose=pose_to_msg(camera.X_PC),
                width=lens.width,
                height=lens.height,
                fx=lens.fx,
                fy=lens.fy,
                cx=lens.cx,
                cy=lens.cy,
                clipping_near=clipping.near,
                clipping_far=clipping.far,
                depth_min=depth_range.min_depth,
                depth_max=depth_range.max_depth,
            ),
            images=sorted(output.value for output in camera.outputs),
            renderer=core.renderer_name,
            rate=camera.rate,
        ),
    )
