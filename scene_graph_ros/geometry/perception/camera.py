"""Cameras: pixels, ranges of depth, and where the sensor is on its body.

The sensor's frame S has x to the right, y down and z ahead. Pixel (u, v), column and row counted
from 0 in the upper left corner, sees along ``((u - cx) / fx, (v - cy) / fy, 1)``: cx and cy are
where the axis meets the image, in coordinates in which pixels' centres are whole numbers.
"""

from __future__ import annotations

from dataclasses import dataclass, field
import math
import numbers
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import QueryArgumentError
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.reals import as_float
from scene_graph_ros.geometry.spatial.elementary import sine_cosine
from scene_graph_ros.geometry.spatial.poses import as_pose, identity

__all__ = [
    "MAX_PIXELS",
    "CameraIntrinsics",
    "ClippingRange",
    "ColorRenderCamera",
    "DepthRange",
    "DepthRenderCamera",
    "RenderCameraCore",
]

MAX_PIXELS = 2**26
"""Of an image, 8192 x 8192; each takes 16 bytes while it is rendered."""

_MAX_NUMBER = 1e9
"""Pixels or metres. Camera numbers beyond are mistakes, and rounding would spoil the pixels."""


def _checked(owner: object, name: str, value: Any, *, positive: bool = True) -> float:
    """Return a finite number. Raises QueryArgumentError, naming class, field and value."""
    label = f"{type(owner).__name__}: {name}"
    number = as_float(value)
    if number is None:
        raise QueryArgumentError(f"{label} must be a number, not {quoted(value)}")
    least = 1.0 / _MAX_NUMBER if positive else -_MAX_NUMBER
    if not least <= number <= _MAX_NUMBER:
        raise QueryArgumentError(
            f"{label} must be between {least:g} and {_MAX_NUMBER:g}, not {quoted(value)}"
        )
    return number


def _put(owner: object, **values: Any) -> None:
    for name, value in values.items():
        object.__setattr__(owner, name, value)


def _checked_type(owner: object, name: str, value: Any, kind: type) -> None:
    if not isinstance(value, kind):
        raise QueryArgumentError(
            f"{type(owner).__name__}: {name} must be a {kind.__name__}, not {quoted(value)}"
        )


@one_line()
@dataclass(frozen=True, slots=True)
class CameraIntrinsics:
    """The size of an image and the lens before it, all in pixels.

    Raises QueryArgumentError for a size that is no whole number or none, more than MAX_PIXELS, a
    focal length that is not positive, and numbers that are not finite. The centre may be anywhere.
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float

    def __post_init__(self) -> None:
        for name in ("width", "height"):
            value = getattr(self, name)
            is_whole = isinstance(value, numbers.Integral) and not isinstance(value, bool)
            if not is_whole or not 1 <= value <= MAX_PIXELS:
                raise QueryArgumentError(
                    f"CameraIntrinsics: {name} must be a whole number of pixels, at least 1, not"
                    f" {quoted(value)}"
                )
            _put(self, **{name: int(value)})
        if self.width * self.height > MAX_PIXELS:
            raise QueryArgumentError(
                f"CameraIntrinsics: {self.width} x {self.height} are more than {MAX_PIXELS} pixels"
            )
        for name in ("fx", "fy", "cx", "cy"):
            value = _checked(self, name, getattr(self, name), positive=name.startswith("f"))
            _put(self, **{name: value})

    @classmethod
    def from_fov_y(cls, width: int, height: int, fov_y: float) -> CameraIntrinsics:
        """Return square pixels and a centre in the middle of the image.

        ``fov_y`` is the angle, in radians, between the upper edge of the image and the lower one.
        Raises QueryArgumentError unless it is between 0 and pi, and as the constructor does.
        """
        angle: Any = fov_y
        is_number = isinstance(angle, numbers.Real) and not isinstance(angle, bool)
        if not (is_number and 0.0 < angle < math.pi):
            raise QueryArgumentError(
                f"CameraIntrinsics: fov_y must be between 0 and pi, not {quoted(fov_y)}"
            )
        cls(width, height, 1.0, 1.0, 0.0, 0.0)
        sine, cosine = sine_cosine(0.5 * fov_y)
        f = 0.5 * height * cosine / sine
        return cls(width, height, f, f, 0.5 * width - 0.5, 0.5 * height - 0.5)

    def matrix(self) -> NDArray[np.float64]:
        """Return the ``(3, 3)`` matrix K: a point p in S is at ``K @ p / p[2]``."""
        return np.array([[self.fx, 0.0, self.cx], [0.0, self.fy, self.cy], [0.0, 0.0, 1.0]])


@one_line()
@dataclass(frozen=True, slots=True)
class ClippingRange:
    """The depths, in m, between which a camera sees anything; raises QueryArgumentError."""

    near: float
    far: float

    def __post_init__(self) -> None:
        near, far = (_checked(self, name, getattr(self, name)) for name in ("near", "far"))
        if not near < far:
            raise QueryArgumentError(
                f"ClippingRange: near must be less than far: {quoted(near)}, {quoted(far)}"
            )
        _put(self, near=near, far=far)


@one_line()
@dataclass(frozen=True, slots=True)
class DepthRange:
    """The depths, in m, that a depth camera tells apart; raises QueryArgumentError."""

    min_depth: float
    max_depth: float

    def __post_init__(self) -> None:
        low, high = (_checked(self, n, getattr(self, n)) for n in ("min_depth", "max_depth"))
        if not low < high:
            raise QueryArgumentError(
                f"DepthRange: min_depth must be less than max_depth: {quoted(low)}, {quoted(high)}"
            )
        _put(self, min_depth=low, max_depth=high)


@one_line()
@dataclass(frozen=True, slots=True, eq=False)
class RenderCameraCore:
    """The common part of cameras: a renderer's name, pixels, clipping and the sensor's pose.

    ``X_BS`` ``(4, 4)`` is the pose of the sensor S on the camera's body B, which queries place.
    Raises QueryArgumentError, and InvalidPoseError for a pose that is not rigid and finite.
    """

    renderer_name: str
    intrinsics: CameraIntrinsics
    clipping: ClippingRange
    X_BS: NDArray[np.float64] = field(default_factory=identity)

    def __post_init__(self) -> None:
        _checked_type(self, "renderer_name", self.renderer_name, str)
        _checked_type(self, "intrinsics", self.intrinsics, CameraIntrinsics)
        _checked_type(self, "clipping", self.clipping, ClippingRange)
        _put(self, X_BS=as_pose(self.X_BS, "X_BS of a RenderCameraCore"))


@one_line()
@dataclass(frozen=True, slots=True)
class ColorRenderCamera:
    """A camera of colour and label images. There is no window to show: images are returned."""

    core: RenderCameraCore
    show_window: bool = False

    def __post_init__(self) -> None:
        _checked_type(self, "core", self.core, RenderCameraCore)
        if self.show_window is not False:
            raise QueryArgumentError(
                f"ColorRenderCamera: show_window must be False, not {quoted(self.show_window)}:"
                " renderers open no windows, they return images"
            )


@one_line()
@dataclass(frozen=True, slots=True)
class DepthRenderCamera:
    """A camera of depth images. Raises QueryArgumentError for a range beyond the clipping."""

    core: RenderCameraCore
    depth_range: DepthRange

    def __post_init__(self) -> None:
        _checked_type(self, "core", self.core, RenderCameraCore)
        _checked_type(self, "depth_range", self.depth_range, DepthRange)
        depth, clipping = self.depth_range, self.core.clipping
        if depth.min_depth < clipping.near or depth.max_depth > clipping.far:
            raise QueryArgumentError(
                f"DepthRenderCamera: {depth} must be within {clipping}: what is clipped is not"
                " seen"
            )
