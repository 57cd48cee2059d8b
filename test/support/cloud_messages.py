"""Points as a camera's driver sends them."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import Header

__all__ = ["cloud_message"]


def cloud_message(points: ArrayLike, frame_id: str = "world") -> PointCloud2:
    """Return points ``(n, 3)`` as floats, one behind the other, without a stamp."""
    data = np.asarray(points, "<f4").reshape(-1, 3)
    return PointCloud2(
        header=Header(frame_id=frame_id),
        height=1,
        width=len(data),
        fields=[
            PointField(name=name, offset=4 * k, datatype=PointField.FLOAT32, count=1)
            for k, name in enumerate("xyz")
        ],
        point_step=12,
        row_step=12 * len(data),
        data=data.tobytes(),
    )
