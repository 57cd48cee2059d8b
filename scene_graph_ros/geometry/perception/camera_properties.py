"""Cameras by older names, which are kept: an angle of view, and for depth two depths."""

from __future__ import annotations

from scene_graph_ros.geometry.perception.camera import (
    CameraIntrinsics,
    ClippingRange,
    ColorRenderCamera,
    DepthRange,
    DepthRenderCamera,
    RenderCameraCore,
)

__all__ = ["CameraProperties", "DepthCameraProperties"]

_CLIPPING = (0.01, 100.0)
"""Metres, where nothing else is said; that of scene files."""


def CameraProperties(
    width: int, height: int, fov_y: float, renderer_name: str
) -> ColorRenderCamera:
    """Return a camera of colour and label images with square pixels, centred.

    ``fov_y`` is the angle, in radians, between the upper edge and the lower one. It sees things
    from 0.01 to 100 m ahead. Raises QueryArgumentError as CameraIntrinsics and RenderCameraCore
    do.
    """
    lens = CameraIntrinsics.from_fov_y(width, height, fov_y)
    return ColorRenderCamera(RenderCameraCore(renderer_name, lens, ClippingRange(*_CLIPPING)))


def DepthCameraProperties(
    width: int, height: int, fov_y: float, renderer_name: str, z_near: float, z_far: float
) -> DepthRenderCamera:
    """Return a camera of depth images, which tells depths from ``z_near`` to ``z_far`` (m) apart.

    Nearer things, down to 0.01 m, have depth 0. Raises as CameraProperties, ClippingRange and
    DepthRange do.
    """
    lens = CameraIntrinsics.from_fov_y(width, height, fov_y)
    depth_range = DepthRange(z_near, z_far)
    clipping = ClippingRange(min(_CLIPPING[0], depth_range.min_depth), depth_range.max_depth)
    return DepthRenderCamera(RenderCameraCore(renderer_name, lens, clipping), depth_range)
