"""Images of depth and their lenses as drivers send them, and those that are none."""

import numpy as np
import pytest
from sensor_msgs.msg import CameraInfo, Image, RegionOfInterest
from std_msgs.msg import Header

from msg_adapters.depth_images import depth_from_msg, lens_from_msg
from msg_adapters.errors import MessageError

INFO = {"height": 48, "width": 64, "k": [50.0, 0.0, 31.0, 0.0, 60.0, 20.0, 0.0, 0.0, 1.0]}
PROJECTED = [52.0, 0.0, 32.0, 0.0, 0.0, 62.0, 21.0, 0.0, 0.0, 0.0, 1.0, 0.0]


def image(depth, kind, *, pad=0, big=False, **fields):
    """Return depths (h, w) as a message, rows longer by some bytes."""
    data = np.asarray(depth).astype((">" if big else "<") + kind)
    rows = np.zeros((data.shape[0], data.shape[1] * data.itemsize + pad), np.uint8)
    rows[:, : data.shape[1] * data.itemsize] = data.view(np.uint8)
    values = {
        "header": Header(frame_id="lens"),
        "height": data.shape[0],
        "width": data.shape[1],
        "encoding": "32FC1" if kind == "f4" else "16UC1",
        "is_bigendian": int(big),
        "step": rows.shape[1],
        "data": rows.tobytes(),
    }
    message = Image(**{**values, **fields})
    message.header.stamp.sec, message.header.stamp.nanosec = 3, 5
    return message


@pytest.mark.parametrize("big", [False, True])
@pytest.mark.parametrize("pad", [0, 3, 16])
@pytest.mark.parametrize(
    ("kind", "raw", "metres"),
    [
        ("u2", [[0, 1, 258], [1500, 65535, 7]], [[np.nan, 0.001, 0.258], [1.5, 65.535, 0.007]]),
        ("f4", [[0.0, 1.25, np.nan], [np.inf, -np.inf, 3.5]], None),
    ],
)
def test_depths_of_both_encodings_byte_orders_and_any_step(big, pad, kind, raw, metres):
    """16UC1 is in mm with 0 for none, 32FC1 in m by REP-117."""
    found = depth_from_msg(image(raw, kind, pad=pad, big=big), 6)
    assert (found.frame_id, found.stamp_ns) == ("lens", 3_000_000_005)
    assert found.depth.dtype == np.float32
    assert found.depth.flags.c_contiguous
    np.testing.assert_allclose(found.depth, np.array(metres or raw, np.float32), rtol=1e-6)


@pytest.mark.parametrize(
    ("said", "fields"),
    [
        ("encoding must be 16UC1, 32FC1, not 'rgb8'", {"encoding": "rgb8"}),
        ("step 11 is less than 3 pixels of 4 bytes", {"step": 11}),
        ("data has 20 bytes, 2 rows of 12 take 24", {"data": bytes(20)}),
        ("data has 24 bytes, 2 rows of 16 take 28", {"step": 16}),
        ("0 x 2 pixels", {"width": 0}),
        ("3 x 0 pixels", {"height": 0}),
        ("3 x 3 pixels, 1 to 6 are read", {"height": 3}),
    ],
)
def test_images_that_are_none_are_named(said, fields):
    """By field and value."""
    with pytest.raises(MessageError) as error:
        depth_from_msg(image(np.ones((2, 3)), "f4", **fields), 6)
    assert said in str(error.value)


def numbers(lens):
    """Return a lens as numbers."""
    return lens.width, lens.height, lens.fx, lens.fy, lens.cx, lens.cy


def test_the_lens_is_k_or_p_of_rectified_images():
    """Zero coefficients are no distortion, by whatever model; rectified images have none."""
    plain = CameraInfo(**INFO, d=[0.0] * 5, distortion_model="plumb_bob", p=PROJECTED)
    assert numbers(lens_from_msg(plain).lens) == (64, 48, 50.0, 60.0, 31.0, 20.0)
    bent = CameraInfo(
        **INFO, d=[0.1, 0.0, 0.0, 0.0, 0.0], distortion_model="plumb_bob", p=PROJECTED
    )
    found = lens_from_msg(bent, rectified=True).lens
    assert numbers(found) == (64, 48, 52.0, 62.0, 32.0, 21.0)


def test_a_region_of_interest_moves_the_centre():
    """Pixel 0 of the image is pixel x_offset of the sensor."""
    roi = RegionOfInterest(x_offset=10, y_offset=5, width=40, height=30)
    found = lens_from_msg(CameraInfo(**INFO, roi=roi)).lens
    assert numbers(found) == (40, 30, 50.0, 60.0, 21.0, 15.0)


@pytest.mark.parametrize(
    ("said", "fields", "rectified"),
    [
        ("rectified: true", {"d": [0.1, 0.0, 0.0, 0.0, 0.0]}, False),
        ("d is [nan]", {"d": [float("nan")]}, False),
        ("binning_x, binning_y are 2, 1", {"binning_x": 2, "binning_y": 1}, False),
        ("beyond the sensor's 64 x 48", {"roi": RegionOfInterest(width=64, height=49)}, False),
        ("no lens", {"k": [0.0] * 9}, False),
        ("fx must be", {"k": [0.0, 0, 31, 0, 60, 20, 0, 0, 1]}, False),
        ("fy must be", {"k": [50.0, 0, 31, 0, -60, 20, 0, 0, 1]}, False),
        ("without skew", {"k": [50.0, 1, 31, 0, 60, 20, 0, 0, 1]}, False),
        ("width must be", {"width": 0}, False),
        ("offset -5.2", {"p": [52.0, 0, 32, -5.2, 0, 62, 21, 0, 0, 0, 1, 0]}, True),
        ("CameraInfo p is no lens", {"p": [0.0] * 12}, True),
    ],
)
def test_lenses_that_are_none_are_named(said, fields, rectified):
    """Distortion, binning, skew, an offset, and numbers that no lens has."""
    values = {**INFO, "p": PROJECTED, **fields}
    for name in values.keys() & {"k", "p"}:
        values[name] = [float(number) for number in values[name]]
    with pytest.raises(MessageError) as error:
        lens_from_msg(CameraInfo(**values), rectified=rectified)
    assert said in str(error.value)
