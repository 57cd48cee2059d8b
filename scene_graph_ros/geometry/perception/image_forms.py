"""Images in the forms that others read: metres by REP-117, millimetres, colours without alpha.

REP-118 says how depth images are encoded: 32-bit floats in metres, or 16-bit whole millimetres
with 0 for no depth. REP-117 defines floats without a distance: minus infinity is too near,
plus infinity too far.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.kernel import lean_kernel
from scene_graph_ros.geometry.perception.camera import CameraIntrinsics

__all__ = ["POINT", "colors", "depths", "millimetres", "points"]

POINT = np.dtype(
    [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("rgb", "<u4"), ("label", "<u4")]
)  # fmt: skip
"""What a pixel sees: metres in the optical frame, 0xRRGGBB, and the value of a RenderLabel."""

_MILLIMETRES = 1000.0
_MOST_MILLIMETRES = 65535.0


class _Lens(NamedTuple):
    fx: float
    fy: float
    cx: float
    cy: float


@lean_kernel
def _write_depths(depth, out):
    for v in range(depth.shape[0]):
        for u in range(depth.shape[1]):
            out[v, u] = depth[v, u] if depth[v, u] > 0.0 else np.float32(-np.inf)


@lean_kernel
def _write_millimetres(depth, out):
    for v in range(depth.shape[0]):
        for u in range(depth.shape[1]):
            # Exact: a float32 times 1000 has less than 53 bits.
            nearest = np.floor(_MILLIMETRES * float(depth[v, u]) + 0.5)
            out[v, u] = np.uint16(nearest) if nearest <= _MOST_MILLIMETRES else np.uint16(0)


@lean_kernel
def _write_colors(color, out):
    for v in range(color.shape[0]):
        for u in range(color.shape[1]):
            for channel in range(3):
                out[v, u, channel] = color[v, u, channel]


@lean_kernel
def _write_points(depth, color, label, lens, place, packed):
    nothing = np.float32(np.nan)
    for v in range(depth.shape[0]):
        y = (v - lens.cy) / lens.fy
        for u in range(depth.shape[1]):
            z = float(depth[v, u])
            if z > 0.0 and z < np.inf:
                place[v, u, 0] = np.float32((u - lens.cx) / lens.fx * z)
                place[v, u, 1] = np.float32(y * z)
                place[v, u, 2] = depth[v, u]
            else:
                for axis in range(3):
                    place[v, u, axis] = nothing
            red, green, blue = color[v, u, 0], color[v, u, 1], color[v, u, 2]
            packed[v, u, 3] = (np.uint32(red) << 16) | (np.uint32(green) << 8) | np.uint32(blue)
            packed[v, u, 4] = np.uint32(label[v, u])


def depths(depth: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return depths ``(h, w)`` of the core in metres as REP-117 has them.

    Minus infinity is nearer than the camera's depth range, where the core has 0.
    """
    out = np.empty(depth.shape, np.float32)
    _write_depths(depth, out)
    return out


def millimetres(depth: NDArray[np.float32]) -> NDArray[np.uint16]:
    """Return depths ``(h, w)`` of the core in millimetres, rounded to nearest, half up.

    0 is no depth: too near, too far, or more than 65.535 m.
    """
    out = np.empty(depth.shape, np.uint16)
    _write_millimetres(depth, out)
    return out


def colors(color: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return ``(h, w, 3)`` red, green and blue of an image ``(h, w, 4)``."""
    out = np.empty((*color.shape[:2], 3), np.uint8)
    _write_colors(color, out)
    return out


def points(
    lens: CameraIntrinsics,
    depth: NDArray[np.float32],
    color: NDArray[np.uint8],
    label: NDArray[np.int16],
) -> NDArray[Any]:
    """Return the points of the core's images as ``(h, w)`` records of type ``POINT``.

    A point is in the camera's optical frame, and NaN where there is no depth.
    """
    out = np.empty(depth.shape, POINT)
    flat = (*depth.shape, POINT.itemsize // 4)
    _write_points(
        depth,
        color,
        label,
        _Lens(lens.fx, lens.fy, lens.cx, lens.cy),
        out.view(np.float32).reshape(flat),
        out.view(np.uint32).reshape(flat),
    )
    return out
