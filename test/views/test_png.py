"""PNG files, read by another library."""

import io

import numpy as np
from PIL import Image
import pytest

from scene_graph_ros.views.png import png


def picture(data):
    """Return the pixels of a PNG file."""
    return np.asarray(Image.open(io.BytesIO(data)))


@pytest.mark.parametrize("size", [(1, 1), (1, 9), (9, 1), (31, 47)])
@pytest.mark.parametrize(
    ("kind", "channels"), [(np.uint8, ()), (np.uint8, (3,)), (np.uint8, (4,)), (np.uint16, ())]
)
def test_png_keeps_every_bit(size, kind, channels):
    """Noise, and what wraps around between rows."""
    rng = np.random.default_rng(sum(size))
    pixels = rng.integers(0, np.iinfo(kind).max, (*size, *channels), kind, endpoint=True)
    np.testing.assert_array_equal(picture(png(pixels)), pixels)


def test_png_takes_arrays_with_gaps():
    """Such as every other pixel of a larger image."""
    pixels = np.arange(600, dtype=np.uint16).reshape(20, 30)[::2, ::3]
    np.testing.assert_array_equal(picture(png(pixels)), pixels)
