"""Heights that a mapper sends: ``sensor_msgs/Image`` of floats to an array."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from sensor_msgs.msg import Image

from msg_adapters.depth_images import pixels_from_msg
from msg_adapters.stamps import checked_stamp_from_msg

__all__ = ["SensedHeights", "heights_from_msg"]

_ENCODINGS = {"32FC1": "f4", "64FC1": "f8"}


class SensedHeights(NamedTuple):
    """A height field's heights at one time."""

    stamp_ns: int
    heights: NDArray[np.float64]
    """``(rows, cols)`` m; the first row is that of the least y."""


def heights_from_msg(msg: Image, most: int) -> SensedHeights:
    """Return the heights of a message, m, copied: 32FC1 or 64FC1, each row along x.

    Raises MessageError for another encoding, a stamp that is no time, no pixels or more than
    ``most``, and rows that overlap or are not there.
    """
    stamp_ns = checked_stamp_from_msg(msg.header.stamp)
    return SensedHeights(stamp_ns, pixels_from_msg(msg, most, _ENCODINGS).astype(np.float64))
