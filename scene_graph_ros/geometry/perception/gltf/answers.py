"""Images of a render server, as those of the core: PNG for colour and label, TIFF for depth."""

from __future__ import annotations

import io
from typing import Any
import warnings

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import EngineError
from scene_graph_ros.geometry.perception.camera import CameraIntrinsics, DepthRange
from scene_graph_ros.geometry.quoting import quoted

__all__ = ["color_of", "depth_of", "label_of"]

_SIXTEEN = ("I;16", "I;16B", "I;16L")
_MILLIMETRES = 1000.0
_TOO_FAR = 65535
_MOST_LABEL = 32767


def _pixels(
    contents: bytes, file_type: str, modes: tuple[str, ...], lens: CameraIntrinsics
) -> NDArray[Any]:
    """Return the pixels of an image of the lens' size. Raises EngineError for any other."""
    from PIL import Image

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            with Image.open(io.BytesIO(contents), formats=[file_type]) as picture:
                if picture.size != (lens.width, lens.height):
                    raise EngineError(
                        f"the image has {picture.size[0]} x {picture.size[1]} pixels, not"
                        f" {lens.width} x {lens.height}"
                    )
                if picture.mode not in modes:
                    raise EngineError(
                        f"the image is of mode {picture.mode!r}, not {' or '.join(modes)}"
                    )
                return np.array(picture)
    except EngineError:
        raise
    except Exception as error:  # decoders raise whatever they meet
        raise EngineError(f"the answer is no {file_type} image: {quoted(error)}") from error


def color_of(contents: bytes, lens: CameraIntrinsics) -> NDArray[np.uint8]:
    """Return ``(h, w, 4)`` of a PNG file with 8 bits a channel, with alpha or without."""
    pixels = _pixels(contents, "PNG", ("RGB", "RGBA"), lens)
    image = np.full((*pixels.shape[:2], 4), 255, np.uint8)
    image[..., : pixels.shape[2]] = pixels
    return image


def label_of(contents: bytes, lens: CameraIntrinsics) -> NDArray[np.int16]:
    """Return ``(h, w)`` of a PNG file of grey with 16 bits."""
    pixels = _pixels(contents, "PNG", (*_SIXTEEN, "I"), lens)
    if pixels.min() < 0 or pixels.max() > _MOST_LABEL:
        raise EngineError(f"the image has labels that are not from 0 to {_MOST_LABEL}")
    return pixels.astype(np.int16)


def depth_of(
    contents: bytes, lens: CameraIntrinsics, depth_range: DepthRange
) -> NDArray[np.float32]:
    """Return ``(h, w)`` metres of a TIFF file: floats in metres, or whole millimetres.

    Of the latter 65535 is too far. Depths out of the range become 0 and inf.
    """
    pixels = _pixels(contents, "TIFF", ("F", *_SIXTEEN), lens)
    if pixels.dtype.kind == "f":
        metres = pixels.astype(np.float64)
        if np.isnan(metres).any():
            raise EngineError("the image has depths that are no numbers")
    else:
        metres = pixels / _MILLIMETRES
        metres[pixels == _TOO_FAR] = np.inf
    metres[metres < depth_range.min_depth] = 0.0
    metres[metres > depth_range.max_depth] = np.inf
    return metres.astype(np.float32)
