"""Images of messages as arrays."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["pixels_of"]

_FORMS = {"rgb8": (np.uint8, 3), "32FC1": (np.float32, 1), "16UC1": (np.uint16, 1)}


def pixels_of(image: Any) -> NDArray[Any]:
    """Return an image ``(h, w)`` or ``(h, w, 3)``. Raises ValueError for other encodings."""
    if image.encoding not in _FORMS:
        raise ValueError(f"images are {', '.join(_FORMS)}, not {image.encoding!r}")
    kind, channels = _FORMS[image.encoding]
    dtype = np.dtype(kind).newbyteorder(">" if image.is_bigendian else "<")
    rows = np.frombuffer(bytes(image.data), np.uint8).reshape(image.height, image.step)
    width = image.width * channels * dtype.itemsize
    pixels = np.ascontiguousarray(rows[:, :width]).view(dtype).astype(kind, copy=False)
    shape = (image.height, image.width) + ((channels,) if channels > 1 else ())
    return pixels.reshape(shape)
