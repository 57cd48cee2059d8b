"""Compressed images, read by another library and by the formulas of their readers."""

import io

import numpy as np
from PIL import Image as Picture
import pytest
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import CompressedImage

from msg_adapters.compressed_images import COMPRESSED_FORMS
from msg_adapters.images import FORMS
from msg_adapters.wire.images import BulkWire
from scene_graph_ros.geometry.perception import CameraIntrinsics, Images

STAMP = 3_000_000_007
HEADER = 12
"""Bytes of the header of compressedDepth: what it is, A and B."""


def picture(data):
    """Return the pixels of a PNG file."""
    return np.asarray(Picture.open(io.BytesIO(bytes(data))))


def seen(depth):
    """Return images with random colours and labels, and this depth ``(h, w)``."""
    rng = np.random.default_rng(5)
    color = rng.integers(0, 256, (*depth.shape, 4), np.uint8)
    label = rng.integers(0, 32764, depth.shape).astype(np.int16)
    return Images(color, depth.astype(np.float32), label)


def message(form, images):
    """Return the message of a form, through the bytes that the node sends."""
    height, width = images.depth.shape
    lens = CameraIntrinsics(width, height, 10.0, 10.0, width / 2, height / 2)
    kind = COMPRESSED_FORMS[form]
    wire = BulkWire(serialize_message, kind.blank(lens), "eye")
    return deserialize_message(wire.data(STAMP, kind.pixels(lens, images)), CompressedImage)


def depth_of(msg):
    """Decode a depth as image_transport does: in 32 bits, NaN for what has none."""
    data = bytes(msg.data)
    kind, A, B = np.frombuffer(data[:HEADER], "<i4,<f4,<f4")[0]
    assert kind == 0
    numbers = picture(data[HEADER:])
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(numbers, A / (numbers.astype(np.float32) - B), np.float32(np.nan)), A


@pytest.mark.parametrize(
    ("form", "says"),
    [
        ("color", "rgb8; png compressed bgr8"),
        ("label", "16UC1; png compressed "),
        ("depth", "32FC1; compressedDepth png"),
        ("depth_raw", "16UC1; compressedDepth png"),
    ],
)
def test_a_message_says_what_it_is(form, says):
    """Encoding, compression, stamp and frame."""
    msg = message(form, seen(np.ones((3, 4))))
    assert msg.format == says
    assert (msg.header.stamp.sec, msg.header.stamp.nanosec) == (3, 7)
    assert msg.header.frame_id == "eye"


def test_colours_labels_and_millimetres_lose_nothing():
    """They are what the plain images show."""
    images = seen(np.random.default_rng(2).uniform(0.01, 80.0, (13, 17)))
    lens = CameraIntrinsics(17, 13, 10.0, 10.0, 8.5, 6.5)
    for form, start in (("color", 0), ("label", 0), ("depth_raw", HEADER)):
        got = picture(bytes(message(form, images).data)[start:])
        np.testing.assert_array_equal(got, FORMS[form].pixels(lens, images))


@pytest.mark.parametrize(
    ("near", "far"),
    [(0.5, 3.0), (0.01, 1e4), (1e-4, 1e-3), (2.0, 2.0 * (1 + 1e-6)), (7.25, 7.25), (1e6, 3e6)],
)
def test_depths_are_as_near_as_the_page_says(near, far):
    """To half a step of the inverse depth, and 32 bits."""
    depth = np.random.default_rng(1).uniform(near, far, (40, 30)).astype(np.float32)
    depth[0, 0], depth[0, 1] = near, far
    got, A = depth_of(message("depth", seen(depth)))
    d = depth.astype(np.float64)
    assert (np.abs(1.0 / got - 1.0 / d) <= 0.5 / A * (1.0 + 1e-6) + 4e-7 / d).all()
    steps = 65534.0 / max(1.0 / near - 1.0 / far, 1.0 / far / 65535.0)
    assert pytest.approx(steps, rel=1e-2) == A


def test_what_has_no_depth_is_nothing():
    """Too near, too far, and an image without any depth at all."""
    depth = np.full((4, 5), 2.0)
    depth[0, 0], depth[1, 1] = 0.0, np.inf
    got, _ = depth_of(message("depth", seen(depth)))
    np.testing.assert_array_equal(np.isnan(got), (depth == 0.0) | np.isinf(depth))
    for nothing in (0.0, np.inf):
        got, _ = depth_of(message("depth", seen(np.full((4, 5), nothing))))
        assert np.isnan(got).all()
