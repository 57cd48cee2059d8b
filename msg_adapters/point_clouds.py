"""Points that a sensor sends: ``sensor_msgs/PointCloud2`` of any layout to arrays.

The message says of itself where x, y and z are in its bytes, how wide they are and in which order.
None of that is believed before it fits the bytes that are there.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from sensor_msgs.msg import PointCloud2, PointField

from msg_adapters.arrays import uint8s_to_msg
from msg_adapters.errors import MessageError
from msg_adapters.poses import header_to_msg
from msg_adapters.stamps import checked_stamp_from_msg
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.tolerances import MAX_COORDINATE

__all__ = ["SensedPoints", "points_from_msg", "sensed_points_to_msg"]

_AXES = ("x", "y", "z")
_FLOATS = {PointField.FLOAT32: "f4", PointField.FLOAT64: "f8"}


class SensedPoints(NamedTuple):
    """A sensor's points at one time."""

    frame_id: str
    """The frame in which the points are; not empty where one is needed."""
    stamp_ns: int
    points: NDArray[np.float64]
    """``(n, 3)`` m: those that are finite and within MAX_COORDINATE."""
    left_out: int
    """How many were not: a pixel that sees nothing is no point."""
    cells: NDArray[np.int64] | None
    """``(n,)``: their places in the message, None where all are there."""
    size: tuple[int, int]
    """Rows and columns of the message."""


def points_from_msg(msg: PointCloud2, most: int, *, needs_frame: bool = True) -> SensedPoints:
    """Return the points of a message, copied.

    Raises MessageError for a message without a frame where one is needed, without x, y or z, with
    these of a type that is no float, more than once or beyond a point's bytes, for rows that
    overlap or are not there, and for more than ``most`` points.
    """
    if needs_frame and not msg.header.frame_id:
        raise MessageError("PointCloud2 has no frame_id, so nobody knows where its points are")
    stamp_ns = checked_stamp_from_msg(msg.header.stamp)
    count = msg.width * msg.height
    if count > most:
        raise MessageError(f"PointCloud2 has {count} points, more than {most}")
    kind = _point_type(msg)
    data = np.frombuffer(msg.data, np.uint8)
    _check_rows(msg, len(data))
    points = np.empty((count, 3))
    if count:
        rows = np.ndarray(
            (msg.height, msg.width), kind, data, strides=(msg.row_step, msg.point_step)
        )
        for axis, name in enumerate(_AXES):
            points[:, axis] = rows[name].reshape(-1)
    is_there = (np.abs(points) <= MAX_COORDINATE).all(axis=1)
    left_out = count - int(np.count_nonzero(is_there))
    cells = np.flatnonzero(is_there) if left_out else None
    return SensedPoints(
        msg.header.frame_id,
        stamp_ns,
        points if cells is None else points[cells],
        left_out,
        cells,
        (msg.height, msg.width),
    )


def sensed_points_to_msg(
    points: NDArray[np.float64], radii: NDArray[np.float64], *, stamp_ns: int, frame_id: str
) -> PointCloud2:
    """Return points ``(n, 3)``, m, as one row of floats x, y, z, radius."""
    data = np.column_stack([points, radii]).astype("<f4")
    return PointCloud2(
        header=header_to_msg(stamp_ns, frame_id),
        height=1,
        width=len(data),
        fields=[
            PointField(name=name, offset=4 * k, datatype=PointField.FLOAT32, count=1)
            for k, name in enumerate((*_AXES, "radius"))
        ],
        is_bigendian=False,
        point_step=16,
        row_step=16 * len(data),
        data=uint8s_to_msg(data.view(np.uint8)),
        is_dense=True,
    )


def _point_type(msg: PointCloud2) -> np.dtype[np.void]:
    """Return the type of a point's bytes, with the places of x, y and z."""
    order, offsets, kinds = ">" if msg.is_bigendian else "<", [], []
    for name in _AXES:
        fields = [field for field in msg.fields if field.name == name]
        if len(fields) != 1:
            named = [field.name for field in msg.fields]
            found = f"has {len(fields)} fields {name!r}" if fields else f"has no field {name!r}"
            raise MessageError(f"PointCloud2 {found}, only {quoted(named)}")
        (field,) = fields
        if field.datatype not in _FLOATS or field.count > 1:
            raise MessageError(
                f"PointCloud2 field {name!r} must be one FLOAT32 or FLOAT64, not {field.count} of"
                f" datatype {field.datatype}"
            )
        kinds.append(order + _FLOATS[field.datatype])
        offsets.append(field.offset)
    for name, offset, kind in zip(_AXES, offsets, kinds, strict=True):
        if offset + np.dtype(kind).itemsize > msg.point_step:
            raise MessageError(
                f"PointCloud2 field {name!r} ends behind a point's {msg.point_step} bytes"
            )
    return np.dtype(
        {"names": _AXES, "formats": kinds, "offsets": offsets, "itemsize": msg.point_step}
    )


def _check_rows(msg: PointCloud2, size: int) -> None:
    """Raise MessageError unless all rows are in the data, one behind the other."""
    if msg.width * msg.point_step > msg.row_step and msg.height > 1:
        raise MessageError(
            f"PointCloud2 row_step {msg.row_step} is less than {msg.width} points of"
            f" {msg.point_step} bytes"
        )
    if not msg.width or not msg.height:
        return
    needed = (msg.height - 1) * msg.row_step + msg.width * msg.point_step
    if needed > size:
        raise MessageError(
            f"PointCloud2 data has {size} bytes, {msg.height} rows of {msg.width} points take"
            f" {needed}"
        )
