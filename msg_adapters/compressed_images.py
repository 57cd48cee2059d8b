"""Images of cameras, compressed, as subscribers of ``image_transport`` read them.

Colours, labels and whole millimetres come without any loss. Depths in metres are sent as 16-bit
inverse depths, which is the only way that the transport ``compressedDepth`` has for them: numbers
v with ``depth = A / (v - B)``, 0 for no depth. A and B are chosen for each image so that its
nearest and farthest depth take the two ends of the numbers; ``1 / depth`` is off by ``1 / (2 A)``
at most, a depth d thus by about ``d^2 / (2 A)``, and by its rounding to 32 bits.
"""

from __future__ import annotations

from collections.abc import Callable
import struct

import numpy as np
from numpy.typing import NDArray
from sensor_msgs.msg import CompressedImage

from msg_adapters.images import FORMS, ImageForm
from scene_graph_ros.geometry.perception import CameraIntrinsics, ImageKind, Images
from scene_graph_ros.views.png import png

__all__ = ["COMPRESSED_FORMS"]

_INVERSE_DEPTH = 0
"""What the transport's header says of how depths are written; there is nothing else."""

_MOST = 65535
"""0 is no depth, so that depths are 1 to this."""


def inverse_depths(depth: NDArray[np.float32]) -> tuple[NDArray[np.uint16], float, float]:
    """Return the numbers of depths ``(h, w)`` of the core, A and B."""
    has_depth = (depth > 0.0) & (depth < np.inf)
    result = np.zeros(depth.shape, np.uint16)
    if not has_depth.any():
        return result, 1.0, 0.0
    inverse = 1.0 / depth[has_depth].astype(np.float64)
    low, high = inverse.min(), inverse.max()
    # Readers have A and B in 32 bits, so these are what is to be written by.
    A = float(np.float32((_MOST - 1) / max(high - low, low / _MOST)))
    B = float(np.float32(1.0 - A * low))
    result[has_depth] = np.rint(A * inverse + B).clip(1, _MOST)
    return result, A, B


def _blank(form: str) -> Callable[[CameraIntrinsics], CompressedImage]:
    return lambda lens: CompressedImage(format=form)


def _bytes(*parts: bytes) -> NDArray[np.uint8]:
    return np.frombuffer(b"".join(parts), np.uint8)


def _as_png(form: ImageForm) -> Callable[[CameraIntrinsics, Images], NDArray[np.uint8]]:
    return lambda lens, images: _bytes(png(form.pixels(lens, images)))


def _header(A: float, B: float) -> bytes:
    return struct.pack("<iff", _INVERSE_DEPTH, A, B)


def _metres(lens: CameraIntrinsics, images: Images) -> NDArray[np.uint8]:
    assert images.depth is not None
    numbers, A, B = inverse_depths(images.depth)
    return _bytes(_header(A, B), png(numbers))


def _millimetres(lens: CameraIntrinsics, images: Images) -> NDArray[np.uint8]:
    return _bytes(_header(0.0, 0.0), png(FORMS["depth_raw"].pixels(lens, images)))


_DEPTH = frozenset({ImageKind.DEPTH})

COMPRESSED_FORMS: dict[str, ImageForm] = {
    # "bgr8" tells readers by OpenCV that what they decode is in that order; a PNG is as it is.
    "color": ImageForm(
        FORMS["color"].kinds, _blank("rgb8; png compressed bgr8"), _as_png(FORMS["color"])
    ),
    "depth": ImageForm(_DEPTH, _blank("32FC1; compressedDepth png"), _metres),
    "depth_raw": ImageForm(_DEPTH, _blank("16UC1; compressedDepth png"), _millimetres),
    "label": ImageForm(
        FORMS["label"].kinds, _blank("16UC1; png compressed "), _as_png(FORMS["label"])
    ),
}
"""By the names of the forms that they compress."""
