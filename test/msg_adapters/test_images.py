"""Images as messages and as bytes, against numpy's own arithmetic and the official serializer."""

import numpy as np
import pytest
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import CameraInfo, Image, PointCloud2
from wire import padding

from msg_adapters.images import camera_info_to_msg, FORMS, image_to_msg
from msg_adapters.wire.images import BulkWire
from scene_graph_ros.geometry.perception import CameraIntrinsics, Images, RenderLabel
from scene_graph_ros.geometry.perception.image_forms import millimetres

LENS = CameraIntrinsics(7, 5, 3.5, 4.5, 2.75, 1.25)
STAMP = 3_000_000_007
NEAR, FAR = np.float32(0.0), np.float32(np.inf)


def images():
    """Distinct pixels, some of them without depth."""
    rng = np.random.default_rng(3)
    color = rng.integers(0, 256, (5, 7, 4), np.uint8)
    depth = rng.uniform(0.5, 70.0, (5, 7)).astype(np.float32)
    depth[0, 0], depth[1, 2], depth[4, 6] = NEAR, FAR, np.float32(65.5354)
    label = rng.integers(0, RenderLabel.MAX_FREE, (5, 7)).astype(np.int16)
    label[1, 2] = RenderLabel.EMPTY
    return Images(color, depth, label)


def message(form):
    """Return the message of a form."""
    return image_to_msg(FORMS[form], LENS, images(), stamp_ns=STAMP, frame_id="eye")


def pixels(msg, dtype, *channels):
    """Read the data of an image as its encoding says."""
    assert msg.step == len(msg.data) // msg.height
    return np.frombuffer(bytes(msg.data), dtype).reshape(msg.height, msg.width, *channels)


@pytest.mark.parametrize(
    ("form", "encoding"),
    [("color", "rgb8"), ("depth", "32FC1"), ("depth_raw", "16UC1"), ("label", "16UC1")],
)
def test_an_image_says_what_it_is(form, encoding):
    """Size, encoding, stamp and frame."""
    msg = message(form)
    assert (msg.width, msg.height, msg.encoding, msg.is_bigendian) == (7, 5, encoding, 0)
    assert (msg.header.stamp.sec, msg.header.stamp.nanosec) == (3, 7)
    assert msg.header.frame_id == "eye"


def test_colours_lose_their_alpha():
    """Red, green and blue stay in this order."""
    np.testing.assert_array_equal(pixels(message("color"), np.uint8, 3), images().color[..., :3])


def test_depths_without_a_distance_are_those_of_rep_117():
    """Minus infinity is too near, plus infinity too far; all others are as they were."""
    depth = images().depth
    got = pixels(message("depth"), np.float32)
    assert got[0, 0] == -np.inf
    assert got[1, 2] == np.inf
    has_distance = np.isfinite(got)
    assert has_distance.sum() == depth.size - 2
    np.testing.assert_array_equal(got[has_distance], depth[has_distance])


def test_millimetres_are_those_of_rep_118():
    """Rounded to nearest; 0 is too near, too far, and what 16 bits do not hold."""
    depth = images().depth.astype(np.float64)
    expected = np.floor(1000.0 * depth + 0.5)
    expected[~(expected <= 65535.0)] = 0.0
    assert expected[4, 6] == 65535.0
    np.testing.assert_array_equal(pixels(message("depth_raw"), np.uint16), expected)


@pytest.mark.parametrize(
    ("metres", "expected"),
    [
        (0.9006, 901),
        (0.0005, 1),  # half up; the float32 nearest to it is larger than it
        (0.000499, 0),
        (0.5, 500),
        (2.0625, 2063),  # exact as float32: 2062.5 mm
        (65.535, 65535),
        (65.5356, 0),
        (1e9, 0),
    ],
)
def test_millimetres_are_rounded_to_nearest(metres, expected):
    """Not cut off, which would be half a millimetre too near on average."""
    assert millimetres(np.array([[metres]], np.float32))[0, 0] == expected


def test_labels_stay_as_they_are():
    """Reserved ones, too."""
    np.testing.assert_array_equal(pixels(message("label"), np.uint16), images().label)


def test_points_are_where_the_pixels_see_them():
    """Each with its colour and label; NaN where there is no depth."""
    seen, msg = images(), message("points")
    assert (msg.width, msg.height, msg.point_step, msg.row_step) == (7, 5, 20, 140)
    assert not msg.is_dense
    kinds = {7: "<f4", 6: "<u4"}
    dtype = np.dtype([(f.name, kinds[f.datatype]) for f in msg.fields])
    assert [dtype.fields[f.name][1] for f in msg.fields] == [f.offset for f in msg.fields]
    points = np.frombuffer(bytes(msg.data), dtype).reshape(5, 7)
    v, u = np.mgrid[:5, :7]
    z = seen.depth.astype(np.float64)
    z[~np.isfinite(z) | (z == 0.0)] = np.nan
    for name, value in (("x", (u - 2.75) / 3.5 * z), ("y", (v - 1.25) / 4.5 * z), ("z", z)):
        np.testing.assert_allclose(points[name], value, rtol=2.0**-23)
    assert np.isnan(points["x"]).sum() == 2
    packed = points["rgb"].view(np.uint32)
    for channel, shift in enumerate((16, 8, 0)):
        np.testing.assert_array_equal(packed >> shift & 255, seen.color[..., channel])
    np.testing.assert_array_equal(points["label"], seen.label)


def test_the_camera_info_is_that_of_a_lens_without_distortion():
    """K, P = [K | 0], R = I, as REP-104 has them."""
    msg = camera_info_to_msg(LENS, stamp_ns=STAMP, frame_id="eye")
    assert isinstance(msg, CameraInfo)
    K = [[3.5, 0, 2.75], [0, 4.5, 1.25], [0, 0, 1]]
    np.testing.assert_array_equal(np.reshape(msg.k, (3, 3)), K)
    np.testing.assert_array_equal(np.reshape(msg.p, (3, 4)), np.column_stack([K, [0, 0, 0]]))
    np.testing.assert_array_equal(np.reshape(msg.r, (3, 3)), np.eye(3))
    assert (msg.distortion_model, list(msg.d)) == ("plumb_bob", [0.0] * 5)
    assert (msg.width, msg.height, msg.header.frame_id) == (7, 5, "eye")


@pytest.mark.parametrize("form", FORMS)
def test_bytes_are_those_of_the_serializer(form):
    """For any stamp, whatever came before."""
    kind = PointCloud2 if form == "points" else Image
    wire = BulkWire(serialize_message, FORMS[form].blank(LENS), "eye")
    for stamp in (1, STAMP):
        data = wire.data(stamp, FORMS[form].pixels(LENS, images()))
        expected = image_to_msg(FORMS[form], LENS, images(), stamp_ns=stamp, frame_id="eye")
        assert deserialize_message(data, kind) == expected
        ours, theirs = (np.frombuffer(b, np.uint8) for b in (data, serialize_message(expected)))
        said = ~padding(expected)
        np.testing.assert_array_equal(ours[said], theirs[said])
