"""Images of depth that a sensor sends: ``sensor_msgs/Image`` and ``CameraInfo`` to arrays.

A message says of itself how it is laid out. None of that is believed before it fits the bytes.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from sensor_msgs.msg import CameraInfo, Image

from msg_adapters.errors import MessageError
from msg_adapters.stamps import checked_stamp_from_msg
from scene_graph_ros.geometry.errors import QueryArgumentError
from scene_graph_ros.geometry.perception.camera import CameraIntrinsics
from scene_graph_ros.geometry.quoting import quoted

__all__ = ["DepthImage", "SensedLens", "depth_from_msg", "lens_from_msg", "pixels_from_msg"]

_METRES = 1e-3
"""Of a unit of 16UC1 (REP-118)."""

_ENCODINGS = {"16UC1": "u2", "32FC1": "f4"}


class DepthImage(NamedTuple):
    """A sensor's depths at one time."""

    frame_id: str
    """The optical frame, "" where the message names none."""
    stamp_ns: int
    depth: NDArray[np.float32]
    """``(h, w)`` m along the optical axis; NaN where there is none, infinite by REP-117."""


class SensedLens(NamedTuple):
    """A sensor's lens, as its CameraInfo says."""

    frame_id: str
    stamp_ns: int
    lens: CameraIntrinsics


def depth_from_msg(msg: Image, most: int) -> DepthImage:
    """Return the depths of a message, copied: 16UC1 in mm with 0 for none, or 32FC1 in m.

    Raises MessageError for another encoding, a stamp that is no time, no pixels or more than
    ``most``, and rows that overlap or are not there.
    """
    stamp_ns = checked_stamp_from_msg(msg.header.stamp)
    depth = pixels_from_msg(msg, most, _ENCODINGS).astype(np.float32)
    if msg.encoding == "16UC1":
        depth *= np.float32(_METRES)
        depth[depth == 0.0] = np.nan
    return DepthImage(msg.header.frame_id, stamp_ns, depth)


def pixels_from_msg(msg: Image, most: int, encodings: Mapping[str, str]) -> NDArray[Any]:
    """Return the pixels ``(h, w)`` of a message, in its bytes, of one of the known encodings.

    ``encodings`` maps them to types of NumPy. Raises MessageError as `depth_from_msg` does.
    """
    kind = encodings.get(msg.encoding)
    if kind is None:
        known = ", ".join(encodings)
        raise MessageError(f"Image encoding must be {known}, not {quoted(msg.encoding)}")
    height, width, pixels = msg.height, msg.width, msg.height * msg.width
    if not 0 < pixels <= most:
        raise MessageError(f"Image has {width} x {height} pixels, 1 to {most} are read")
    dtype = np.dtype((">" if msg.is_bigendian else "<") + kind)
    data = np.frombuffer(msg.data, np.uint8)
    if msg.step < width * dtype.itemsize:
        raise MessageError(
            f"Image step {msg.step} is less than {width} pixels of {dtype.itemsize} bytes"
        )
    needed = (height - 1) * msg.step + width * dtype.itemsize
    if needed > len(data):
        raise MessageError(
            f"Image data has {len(data)} bytes, {height} rows of {msg.step} take {needed}"
        )
    return np.ndarray((height, width), dtype, data, strides=(msg.step, dtype.itemsize))


def lens_from_msg(msg: CameraInfo, *, rectified: bool = False) -> SensedLens:
    """Return the lens of a CameraInfo: its matrix K or, of ``rectified`` images, P.

    A region of interest moves the centre and gives the size. Raises MessageError for distortion
    that is not zero unless the images are rectified, for binning, for skew, for a P with an
    offset, for a region beyond the sensor, and for numbers that no lens has, such as a K of zeros,
    which is an uncalibrated camera.
    """
    stamp_ns = checked_stamp_from_msg(msg.header.stamp)
    if not rectified and any(value != 0.0 for value in msg.d):
        raise MessageError(
            f"CameraInfo d is {quoted(list(msg.d))} ({quoted(msg.distortion_model)}): images with"
            " distortion are not read; send rectified ones, and say rectified: true in the scene"
        )
    if max(msg.binning_x, 1) * max(msg.binning_y, 1) > 1:
        raise MessageError(
            f"CameraInfo binning_x, binning_y are {msg.binning_x}, {msg.binning_y}: binned images"
            " are not read, since cameras differ in where their pixels are"
        )
    matrix, rows = (msg.p, 4) if rectified else (msg.k, 3)
    name = "p" if rectified else "k"
    fx, skew, cx, fy, cy = (float(matrix[i]) for i in (0, 1, 2, rows + 1, rows + 2))
    last = [float(value) for value in matrix[2 * rows : 2 * rows + 3]]
    if skew != 0.0 or float(matrix[rows]) != 0.0 or last != [0.0, 0.0, 1.0]:
        raise MessageError(f"CameraInfo {name} is no lens without skew: {list(matrix)}")
    if rectified and (msg.p[3] != 0.0 or msg.p[7] != 0.0):
        raise MessageError(
            f"CameraInfo p has the offset {msg.p[3]}, {msg.p[7]} of a second camera: depths are"
            " read in the first one's frame"
        )
    width, height, roi = msg.width, msg.height, msg.roi
    if roi.width or roi.height:
        if roi.x_offset + roi.width > width or roi.y_offset + roi.height > height:
            raise MessageError(
                f"CameraInfo roi of {roi.width} x {roi.height} at {roi.x_offset}, {roi.y_offset}"
                f" is beyond the sensor's {width} x {height} pixels"
            )
        width, height = roi.width, roi.height
        cx, cy = cx - roi.x_offset, cy - roi.y_offset
    try:
        lens = CameraIntrinsics(width, height, fx, fy, cx, cy)
    except QueryArgumentError as error:
        raise MessageError(f"CameraInfo {name} is no lens: {error}") from error
    return SensedLens(msg.header.frame_id, stamp_ns, lens)
