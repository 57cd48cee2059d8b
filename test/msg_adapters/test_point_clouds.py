"""Points of a sensor in all layouts that the message allows, and in those that it does not."""

from builtin_interfaces.msg import Time
import numpy as np
import pytest
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import Header

from msg_adapters.errors import MessageError
from msg_adapters.point_clouds import points_from_msg

POINTS = np.array([[1.0, -2.0, 0.5], [0.25, 3.0, -4.0], [5.0, 6.0, 7.0], [0.0, 0.125, 9.0]])
STAMP = Time(sec=12, nanosec=345)


def message(kind, points=POINTS, *, rows=1, gap=0):
    """Return points as records of a type with x, y and z; each row ends with ``gap`` bytes."""
    kind = np.dtype(kind)
    records = np.zeros(len(points), kind)
    for axis, name in enumerate("xyz"):
        records[name] = points[:, axis]
    width = len(points) // rows
    lines = [records[width * k : width * (k + 1)].tobytes() + bytes(gap) for k in range(rows)]
    numbers = {4: PointField.FLOAT32, 8: PointField.FLOAT64}
    return PointCloud2(
        header=Header(stamp=STAMP, frame_id="lens"),
        height=rows,
        width=width,
        fields=[
            PointField(name=name, offset=offset, datatype=numbers[part.itemsize], count=1)
            for name, (part, offset, *_) in kind.fields.items()
            if part.kind == "f"
        ],
        is_bigendian=kind["x"].byteorder == ">",
        point_step=kind.itemsize,
        row_step=width * kind.itemsize + gap,
        data=b"".join(lines),
        is_dense=True,
    )


FLAT = [("x", "<f4"), ("y", "<f4"), ("z", "<f4")]
LAYOUTS = {
    "flat": FLAT,
    "of doubles": [("x", "<f8"), ("y", "<f8"), ("z", "<f8")],
    "of both": [("x", "<f8"), ("y", "<f4"), ("z", "<f8")],
    "big end first": [("x", ">f4"), ("y", ">f4"), ("z", ">f4")],
    "padded": [*FLAT, ("", "V4")],
    "among others": [("intensity", "<f4"), ("z", "<f4"), ("x", "<f4"), ("", "V3"), ("y", "<f4")],
}


@pytest.mark.parametrize(("rows", "gap"), [(1, 0), (2, 0), (4, 5)])
@pytest.mark.parametrize("kind", LAYOUTS.values(), ids=LAYOUTS)
def test_points_are_read_in_any_layout(kind, rows, gap):
    """These numbers are exact as float32."""
    found = points_from_msg(message(kind, rows=rows, gap=gap), 4)
    assert found.points.tolist() == POINTS.tolist()
    assert found.points.flags.c_contiguous
    assert found.points.dtype == np.float64
    assert (found.frame_id, found.stamp_ns, found.left_out) == ("lens", 12_000_000_345, 0)


def test_pixels_that_see_nothing_are_no_points():
    """NaN and infinity, in any coordinate, and what is beyond all scenes."""
    points = np.repeat(POINTS, 2, axis=0)
    points[0, 1], points[3, 2], points[4, 0] = np.nan, np.inf, 2e12
    found = points_from_msg(message(FLAT, points), 8)
    assert found.left_out == 3
    assert found.points.tolist() == np.delete(points, [0, 3, 4], axis=0).tolist()


def test_there_may_be_no_points():
    """An empty image is one, and its data may be empty, too."""
    found = points_from_msg(message(FLAT, POINTS[:0]), 0)
    assert found.points.shape == (0, 3)


def changed(**fields):
    """Return a change of a message's fields."""

    def change(msg):
        for name, value in fields.items():
            setattr(msg, name, value)

    return change


def with_field(row, **fields):
    """Return a change of what a message says of one coordinate."""
    return lambda msg: changed(**fields)(msg.fields[row])


NO_TIME = Header(stamp=Time(nanosec=10**9), frame_id="lens")
WRONG = {
    "no frame": (changed(header=Header(stamp=STAMP)), "no frame_id"),
    "stamp": (changed(header=NO_TIME), "stamp is no time"),
    "too many": (changed(width=2**31), "more than 4"),
    "no z": (with_field(2, name="depth"), "has no field 'z'"),
    "two x": (with_field(1, name="x"), "has 2 fields 'x'"),
    "integers": (with_field(0, datatype=PointField.UINT32), "'x' must be one FLOAT32"),
    "several": (with_field(0, count=3), "not 3 of datatype"),
    "beyond a point": (with_field(2, offset=9), "'z' ends behind a point's 12 bytes"),
    "no point_step": (changed(point_step=0), "ends behind a point's 0 bytes"),
    "short data": (lambda msg: changed(data=msg.data[:-1])(msg), "47 bytes, 2 rows of 2"),
    "rows overlap": (changed(row_step=12), "row_step 12 is less"),
    "rows far apart": (changed(row_step=1000), "48 bytes, 2 rows of 2 points take 1024"),
}


@pytest.mark.parametrize(("change", "told"), WRONG.values(), ids=WRONG)
def test_what_does_not_fit_its_bytes_is_refused_by_name(change, told):
    """Nothing outside of them is read."""
    msg = message(FLAT, rows=2)
    change(msg)
    with pytest.raises(MessageError, match=told):
        points_from_msg(msg, 4)
