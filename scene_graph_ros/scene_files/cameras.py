"""Turn a camera of a scene file into the core's types."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.perception import (
    CameraDescription,
    CameraIntrinsics,
    CameraOutput,
    ClippingRange,
    DepthRange,
    DepthRenderCamera,
    RenderCameraCore,
)
from scene_graph_ros.scene_files.schema import CameraSpec

__all__ = ["camera_from_spec"]


def camera_from_spec(
    spec: CameraSpec,
    X_PC: NDArray[np.float64],
    name: str,
    source: str,
    located: Callable[[str], AbstractContextManager[None]],
) -> CameraDescription:
    """Return the camera at ``X_PC`` ``(4, 4)`` in its frame.

    Everything about a field of the file is done in ``located(field)``, which says where an error
    of the core comes from. Raises InvalidNameError and QueryArgumentError.
    """
    width, height = spec.size
    with located("size"):
        # Whatever the lens is like.
        CameraIntrinsics(width, height, 1.0, 1.0, 0.0, 0.0)
    if spec.intrinsics is not None:
        with located("intrinsics"):
            lens = spec.intrinsics
            intrinsics = CameraIntrinsics(width, height, lens.fx, lens.fy, lens.cx, lens.cy)
    else:
        assert spec.fov_y is not None  # the schema checked it
        with located("fov_y"):
            intrinsics = CameraIntrinsics.from_fov_y(width, height, spec.fov_y)
    with located("clipping"):
        clipping = ClippingRange(*spec.clipping)
        core = RenderCameraCore(spec.renderer, intrinsics, clipping)
    with located("depth_range"):
        depth_range = DepthRange(*(spec.depth_range or spec.clipping))
        camera = DepthRenderCamera(core, depth_range)
    outputs = frozenset(map(CameraOutput, spec.images))
    with located("name"):
        return CameraDescription(name, source, spec.frame, X_PC, camera, outputs, spec.rate)
