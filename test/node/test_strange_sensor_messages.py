"""What drivers may send, over DDS: every good form counts, every bad one is counted and named."""

from time import sleep

from cloud_messages import cloud_message
from diagnostic_msgs.msg import DiagnosticArray
from node_harness import diagnostics_from_now, diagnostics_values, wait_until
import numpy as np
import pytest
from sensor_msgs.msg import CameraInfo, Image, PointCloud2, PointField

from scene_graph_ros.node.runtime.qos import image_qos

SCENE = """
version: 1
sources:
  - {name: eye, depth: {image: eye/depth, frame: world, step: 1, rate: 1000}}
  - {name: lidar, points: {fills: eye, rate: 1000}}
geometries:
  - {name: seen, source: eye, roles: {proximity: {}}, shape: {type: point_cloud, radius: 0.0625}}
"""
K = [3.0, 0.0, 1.0, 0.0, 3.0, 0.5, 0.0, 0.0, 1.0]
DEPTHS = np.array([[1.0, 2.0, 1.5], [0.5, 2.5, 1.25]])
"""m: of two rows of three pixels."""


@pytest.fixture(scope="module")
def node(start_node, tmp_path_factory):
    """A node with a camera and a lidar that fill one cloud of 100 points at most."""
    scene = tmp_path_factory.mktemp("sensors") / "scene.yaml"
    scene.write_text(SCENE)
    return start_node({"scene": scene, "diagnostics_rate": 20.0, "max_points_per_cloud": 100})


@pytest.fixture(scope="module")
def topics(client, node):
    """Publishers of images, lenses and clouds, and what the node puts out."""
    return {
        "image": client.publisher(Image, "/eye/depth"),
        "info": client.publisher(CameraInfo, "/eye/camera_info"),
        "cloud": client.publisher(PointCloud2, "/lidar/points"),
        "eye": client.listen(PointCloud2, "sensed/eye", image_qos()),
        "lidar": client.listen(PointCloud2, "sensed/lidar", image_qos()),
        "diagnostics": client.listen(DiagnosticArray, "/diagnostics"),
    }


STATUS = {
    "image": "source eye depth images",
    "info": "source eye camera info",
    "cloud": "source lidar points",
}


def counts(client, topics, kind):
    """Return what diagnostics count of a kind of message, by now."""
    found = diagnostics_from_now(client, topics["diagnostics"])
    return diagnostics_values(found, STATUS[kind])


def image(encoding="32FC1", *, big=False, pad=0, **fields):
    """Return DEPTHS as a message, with rows that are longer by some bytes."""
    kind, values = ("f4", DEPTHS) if encoding == "32FC1" else ("u2", 1e3 * DEPTHS)
    rows = values.astype((">" if big else "<") + kind)
    padded = [row.tobytes() + bytes([255]) * pad for row in rows]
    message = Image(height=2, width=3, encoding=encoding, is_bigendian=int(big))
    message.step, message.data = len(padded[0]), b"".join(padded)
    for name, value in fields.items():
        setattr(message, name, value)
    return message


def cloud(*, big=False, kind="f8", pad=0, **fields):
    """Return two rows of two points, as doubles behind four other bytes, with longer rows."""
    order, size = ">" if big else "<", np.dtype(kind).itemsize
    names = PointField.FLOAT64 if kind == "f8" else PointField.FLOAT32
    message = PointCloud2(height=2, width=2, is_bigendian=big, point_step=4 + 3 * size)
    message.header.frame_id = "world"
    message.fields = [
        PointField(name=axis, offset=4 + size * k, datatype=names, count=1)
        for k, axis in enumerate("xyz")
    ]
    rows = b""
    for row in ([[1, 2, 3], [2, 2, 3]], [[3, 2, 3], [np.nan, 2, 3]]):
        rows += b"".join(b"abcd" + np.array(p, order + kind).tobytes() for p in row) + bytes(pad)
    message.row_step, message.data = 2 * message.point_step + pad, rows
    for name, value in fields.items():
        setattr(message, name, value)
    return message


def send(client, topics, kind, message, ahead=0):
    """Publish a message of now."""
    sleep(0.005)
    message.header.stamp = client.now()
    message.header.stamp.sec += ahead
    topics[kind].publish(message)
    return message.header.stamp


def z_of(message):
    """Return the z of points that the node put out."""
    return np.frombuffer(message.data, "<f4").reshape(-1, 4)[:, 2]


def is_seen(client, topics, kind, source, make):
    """Send until the node puts out what it made of a message; return that."""
    stamps = []

    def is_there():
        stamps.append(send(client, topics, kind, make()))
        sleep(0.05)
        newest = topics[source].newest
        return newest is not None and newest.header.stamp in stamps

    wait_until(is_there, "the points")
    return topics[source].newest


@pytest.mark.parametrize("encoding", ["32FC1", "16UC1"])
@pytest.mark.parametrize(("big", "pad"), [(False, 0), (True, 0), (False, 5), (True, 6)])
def test_images_count_in_either_byte_order_and_with_padded_rows(
    client, topics, encoding, big, pad
):
    """Each pixel is a point at its depth."""
    topics["info"].publish(CameraInfo(height=2, width=3, k=K))
    found = is_seen(client, topics, "image", "eye", lambda: image(encoding, big=big, pad=pad))
    np.testing.assert_allclose(z_of(found), DEPTHS.ravel(), rtol=1e-6)


def test_pixels_without_a_depth_are_no_points_and_no_fault(client, topics):
    """NaN and zero in metres, zero in millimetres."""
    topics["info"].publish(CameraInfo(height=2, width=3, k=K))
    metres = np.array([[np.nan, 0, 1], [np.inf, -np.inf, -1]], "<f4").tobytes()
    found = is_seen(client, topics, "image", "eye", lambda: image(data=metres))
    np.testing.assert_array_equal(z_of(found), [1.0])
    raw = np.array([[0, 0, 0], [0, 750, 0]], "<u2").tobytes()
    found = is_seen(client, topics, "image", "eye", lambda: image("16UC1", data=raw))
    np.testing.assert_allclose(z_of(found), [0.75], rtol=1e-6)


@pytest.mark.parametrize("kind", ["f4", "f8"])
@pytest.mark.parametrize(("big", "pad"), [(False, 0), (True, 0), (False, 3), (True, 7)])
def test_clouds_count_in_either_byte_order_and_with_padded_rows(client, topics, kind, big, pad):
    """Also where points have other bytes before them; NaN is no point."""
    found = is_seen(client, topics, "cloud", "lidar", lambda: cloud(kind=kind, big=big, pad=pad))
    points = np.frombuffer(found.data, "<f4").reshape(-1, 4)[:, :3]
    np.testing.assert_array_equal(points, [[1, 2, 3], [2, 2, 3], [3, 2, 3]])


def of_integers():
    """Return a cloud whose coordinates are no floats."""
    message = cloud()
    for field in message.fields:
        field.datatype = PointField.INT32
    return message


def without_z():
    """Return a cloud without one of its fields."""
    message = cloud()
    return cloud(fields=list(message.fields)[:2])


@pytest.mark.parametrize(
    ("kind", "fault", "make", "ahead"),
    [
        ("image", "malformed", lambda: image(encoding="rgb8"), 0),
        ("image", "malformed", lambda: image(encoding=""), 0),
        ("image", "malformed", lambda: image(step=11), 0),
        ("image", "malformed", lambda: image(data=bytes(23)), 0),
        ("image", "malformed", lambda: image(height=0), 0),
        ("image", "malformed", lambda: image(height=2**31, width=2**31), 0),
        ("image", "wrong_length", lambda: image(height=1), 0),
        ("image", "future", image, 100),
        ("image", "stale", image, -100),
        ("info", "malformed", lambda: CameraInfo(height=2, width=3, k=[0.0] * 9), 0),
        ("info", "malformed", lambda: CameraInfo(height=2, width=3, k=[np.nan, *K[1:]]), 0),
        ("info", "malformed", lambda: CameraInfo(height=2, width=3, k=[-1.0, *K[1:]]), 0),
        ("info", "malformed", lambda: CameraInfo(height=2, width=3, k=K, d=[0.1]), 0),
        ("info", "malformed", lambda: CameraInfo(height=0, width=3, k=K), 0),
        ("info", "malformed", lambda: CameraInfo(height=2, width=3, k=K, binning_x=2), 0),
        ("cloud", "malformed", lambda: cloud_message([[1, 2, 3]], ""), 0),
        ("cloud", "unknown_frame", lambda: cloud_message([[1, 2, 3]], "odom"), 0),
        ("cloud", "malformed", of_integers, 0),
        ("cloud", "malformed", without_z, 0),
        ("cloud", "malformed", lambda: cloud(fields=[]), 0),
        ("cloud", "malformed", lambda: cloud(row_step=8), 0),
        ("cloud", "malformed", lambda: cloud(data=bytes(8)), 0),
        ("cloud", "malformed", lambda: cloud(point_step=8), 0),
        ("cloud", "too_large", lambda: cloud(height=2**16, width=2**14), 0),
        ("cloud", "too_large", lambda: cloud_message(np.ones((101, 3))), 0),
        ("cloud", "too_large", lambda: cloud_message(np.ones((300_000, 3))), 0),
        ("cloud", "future", cloud, 100),
        ("cloud", "stale", cloud, -100),
    ],
)
def test_what_is_wrong_is_counted_and_named(client, topics, kind, fault, make, ahead):
    """Once for each message; and good ones count after it."""
    before = int(counts(client, topics, kind)[fault])
    send(client, topics, kind, make(), ahead)
    wait_until(lambda: int(counts(client, topics, kind)[fault]) == before + 1, f"one more {fault}")


def test_a_lens_of_another_size_is_that_of_no_image(client, topics):
    """Images are refused until it is right again; a refused lens leaves the one before."""
    topics["info"].publish(CameraInfo(height=4, width=6, k=K))
    before = int(counts(client, topics, "image")["wrong_length"])

    def is_counted():
        send(client, topics, "image", image())
        return int(counts(client, topics, "image")["wrong_length"]) > before

    wait_until(is_counted, "an image of another size than its lens")
    topics["info"].publish(CameraInfo(height=2, width=3, k=K))
    topics["info"].publish(CameraInfo(height=2, width=3, k=K, d=[0.1]))
    found = is_seen(client, topics, "image", "eye", image)
    assert len(z_of(found)) == DEPTHS.size


def test_the_node_survived_all_of_it(client, node):
    """It lives, and has no internal error on record."""
    assert node.is_alive()
    assert "Traceback" not in node.output()
