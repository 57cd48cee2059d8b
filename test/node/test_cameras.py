"""Cameras through the node: what is asked for comes, of one moment, and nothing else is done."""

from __future__ import annotations

import io

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseStamped
from node_harness import diagnostics_from_now, diagnostics_values, wait_until
import numpy as np
from PIL import Image as Picture
import pytest
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import (
    CameraInfo,
    CompressedImage,
    Image,
    MultiDOFJointState,
    PointCloud2,
)

from msg_adapters.poses import multi_dof_joint_state_to_msg, pose_from_msg
from msg_adapters.stamps import stamp_from_msg
from scene_graph_msgs.msg import FrameDescription, LabelTable, SourceHandle, Status

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
CAMERA = """
  - name: {name}
    source: arm
    frame: hand
    pose: {{xyz: [0, 0, 0.5]}}
    size: [16, 12]
    intrinsics: {{fx: 16, fy: 16, cx: 8, cy: 6}}
    clipping: [0.01, 4]
    depth_range: [0.125, 4]
    images: {images}
    rate: 1000
"""
SCENE = f"""
version: 1
sources: [{{name: cell}}, {{name: arm}}, {{name: other}}]
frames: [{{name: hand, source: arm}}, {{name: spare, source: other}}]
geometries:
  - name: wall
    source: cell
    pose: {{xyz: [0, 0, 3.5]}}
    shape: {{type: box, size: [0.5, 8, 1]}}
    color: [1, 0, 0]
    label: 7
cameras:
{CAMERA.format(name="eye", images="[color, depth, label, points]")}
{CAMERA.format(name="quiet", images="[color]")}
{CAMERA.format(name="spare", images="[depth]").replace("arm", "other").replace("hand", "spare")}
"""
# The hand at z, the eye half a metre before it: the wall's near face is 2.5 m - z away.
SECOND = 10**9


@pytest.fixture(scope="module")
def node(start_node, tmp_path_factory):
    """A node with three cameras before a wall."""
    path = tmp_path_factory.mktemp("cameras") / "scene.yaml"
    path.write_text(SCENE)
    return start_node({"scene": path, "diagnostics_rate": 20.0})


@pytest.fixture(scope="module")
def hand(node, client):
    """Moves the hand along z."""
    publisher = client.publisher(MultiDOFJointState, "/arm/poses")

    def move(z):
        stamp = client.node.get_clock().now().nanoseconds
        X = np.eye(4)
        X[2, 3] = z
        publisher.publish(
            multi_dof_joint_state_to_msg(["hand"], X[None], stamp_ns=stamp, frame_id="world")
        )
        return stamp

    return move


def effect(client, name):
    """Return what the node says about an effect."""
    return next(e for e in client.call("ListEffects").effects if e.name == name)


def array(msg, dtype, *channels):
    """Return the pixels of an image."""
    return np.frombuffer(bytes(msg.data), dtype).reshape(msg.height, msg.width, *channels)


def picture(data):
    """Return the pixels of a PNG file."""
    return np.asarray(Picture.open(io.BytesIO(bytes(data))))


def test_only_what_cameras_offer_is_advertised(node, client):
    """Each has its pose; depth comes with its 16-bit form, labels with their table."""
    start = "/scene_graph/cameras/"
    depth = {
        *("depth/image", "depth/image_raw", "depth/camera_info"),
        *("depth/image/compressedDepth", "depth/image_raw/compressedDepth"),
    }
    color = {"color/image", "color/image/compressed", "color/camera_info"}
    label = {"label/image", "label/image/compressed", "label/table"}
    expected = {
        *(f"eye/{t}" for t in {*depth, *color, *label, "points", "pose"}),
        *(f"quiet/{t}" for t in {*color, "pose"}),
        *(f"spare/{t}" for t in {*depth, "pose"}),
    }

    def found():
        return {t.removeprefix(start) for t in client.topics() if t.startswith(start)}

    wait_until(lambda: found() >= expected, "the topics of all cameras")
    assert found() == expected
    report = effect(client, "camera eye")
    assert report.is_on
    assert report.reason == "the scene has it on frame arm/hand"
    assert {t.removeprefix(start + "eye/") for t in report.topics} == {
        t.removeprefix("eye/") for t in expected if t.startswith("eye/")
    }


def test_all_kinds_are_of_one_moment(node, client, hand):
    """Colour, depth in both forms, labels and points have the stamp of the poses they show."""
    kinds = {
        "color/image": Image,
        "color/camera_info": CameraInfo,
        "depth/image": Image,
        "depth/image_raw": Image,
        "depth/camera_info": CameraInfo,
        "label/image": Image,
        "points": PointCloud2,
        "pose": PoseStamped,
    }
    heard = {t: client.listen(kind, f"cameras/eye/{t}") for t, kind in kinds.items()}
    stamp = hand(0.25)

    def is_of_it(message):
        return stamp_from_msg(message.header.stamp) == stamp

    got = {t: listener.wait_for(is_of_it, t) for t, listener in heard.items()}
    for topic, message in got.items():
        expected = "world" if topic == "pose" else "eye_optical_frame"
        assert message.header.frame_id == expected
    depth, raw = array(got["depth/image"], np.float32), array(got["depth/image_raw"], np.uint16)
    # The wall is 0.5 m wide and its face 2.25 m ahead: 16 * 0.25 / 2.25 = 1.8 pixels each way.
    wall = np.zeros((12, 16), bool)
    wall[:, 7:10] = True
    np.testing.assert_array_equal(depth[wall], np.float32(2.25))
    np.testing.assert_array_equal(depth[~wall], np.inf)
    np.testing.assert_array_equal(raw, np.where(wall, 2250, 0))
    label = array(got["label/image"], np.uint16)
    np.testing.assert_array_equal(label, np.where(wall, 7, LabelTable.EMPTY))
    color = array(got["color/image"], np.uint8, 3)
    np.testing.assert_array_equal(color[wall], [[255, 0, 0]] * wall.sum())
    assert not (color[~wall] == [255, 0, 0]).all(axis=-1).any()
    fields = [(f.name, "<f4" if f.datatype == 7 else "<u4") for f in got["points"].fields]
    points = np.frombuffer(bytes(got["points"].data), fields).reshape(12, 16)
    np.testing.assert_array_equal(np.isnan(points["z"]), ~wall)
    assert points["x"][6, 9] == pytest.approx(2.25 / 16, rel=1e-7)
    X_WC = pose_from_msg(got["pose"].pose, "pose")
    np.testing.assert_allclose(X_WC[:3, 3], [0.0, 0.0, 0.75], atol=1e-15)
    assert np.reshape(got["depth/camera_info"].k, (3, 3))[0].tolist() == [16.0, 0.0, 8.0]
    for listener in heard.values():
        client.forget(listener)


def test_compressed_images_show_the_same(node, client, hand):
    """Each as its readers decompress it, of the moment of the plain image."""
    plain = {t: client.listen(Image, f"cameras/eye/{t}/image") for t in ("color", "label")}
    files = {
        t: client.listen(CompressedImage, f"cameras/eye/{t}")
        for t in (
            *("color/image/compressed", "label/image/compressed"),
            *("depth/image/compressedDepth", "depth/image_raw/compressedDepth"),
        )
    }
    stamp = hand(0.125)

    def of_it(listener, what):
        return listener.wait_for(lambda m: stamp_from_msg(m.header.stamp) == stamp, what)

    color, label = (of_it(each, name) for name, each in plain.items())
    got = {topic: of_it(each, topic) for topic, each in files.items()}
    assert {m.header.frame_id for m in got.values()} == {"eye_optical_frame"}
    np.testing.assert_array_equal(
        picture(got["color/image/compressed"].data), array(color, np.uint8, 3)
    )
    np.testing.assert_array_equal(
        picture(got["label/image/compressed"].data), array(label, np.uint16)
    )
    millimetres = picture(bytes(got["depth/image_raw/compressedDepth"].data)[12:])
    wall = millimetres > 0
    assert wall.sum() > 20
    np.testing.assert_array_equal(millimetres[wall], 2375)
    data = bytes(got["depth/image/compressedDepth"].data)
    _, A, B = np.frombuffer(data[:12], "<i4,<f4,<f4")[0]
    numbers = picture(data[12:])
    np.testing.assert_array_equal(numbers > 0, wall)
    np.testing.assert_allclose(A / (numbers[wall] - B), 2.375, rtol=2e-7)
    for listener in (*plain.values(), *files.values()):
        client.forget(listener)


def test_too_near_is_minus_infinity(node, client, hand):
    """The face is less than the least depth ahead, but not clipped: it is there, without depth."""
    depths = client.listen(Image, "cameras/eye/depth/image")
    raws = client.listen(Image, "cameras/eye/depth/image_raw")
    stamp = hand(2.4)
    near, raw = (
        each.wait_for(lambda m: stamp_from_msg(m.header.stamp) == stamp, "the image")
        for each in (depths, raws)
    )
    assert array(near, np.float32)[6, 8] == -np.inf
    assert array(raw, np.uint16)[6, 8] == 0
    for listener in (depths, raws):
        client.forget(listener)


def values_of(client, name):
    """Return what diagnostics say of a camera, from a message made after the call."""
    listener = client.listen(DiagnosticArray, "/diagnostics")
    message = diagnostics_from_now(client, listener)
    values = diagnostics_values(message, f"effect: camera {name}")
    client.forget(listener)
    return values


def test_who_listens_decides_what_is_rendered(node, client, hand):
    """Labels alone shade nothing; a camera that nobody hears makes no frame."""
    before = values_of(client, "eye")
    labels = client.listen(Image, "cameras/eye/label/image")
    stamp = hand(0.5)
    labels.wait_for(lambda m: stamp_from_msg(m.header.stamp) == stamp, "labels")
    client.forget(labels)
    after = values_of(client, "eye")

    def rendered(values, kind):
        return int(values.get(f"{kind} images rendered", 0))

    assert rendered(after, "label") > rendered(before, "label")
    for kind in ("color", "depth"):
        assert rendered(after, kind) == rendered(before, kind)
    assert values_of(client, "quiet")["frames"] == "0"


def test_what_did_not_change_is_rendered_once(node, client, hand):
    """Images go on at the rate of updates, but of the same poses they are the same."""
    colors = client.listen(Image, "cameras/eye/color/image")
    stamp = hand(0.75)
    colors.wait_for(lambda m: stamp_from_msg(m.header.stamp) == stamp, "the image")
    before = values_of(client, "eye")
    count = colors.count
    wait_until(lambda: colors.count >= count + 3, "more of the same")

    def later():
        values = values_of(client, "eye")
        # A frame is counted after its last message has gone out.
        return int(values["frames"]) >= int(before["frames"]) + 3 and values

    after = wait_until(later, "the count of three frames")
    assert after["color images rendered"] == before["color images rendered"]
    client.forget(colors)


def test_the_table_names_who_has_a_label(node, client):
    """For those who come late, too."""
    for qos in (LATCHED, QoSProfile(depth=1)):
        tables = client.listen(LabelTable, "cameras/eye/label/table", qos)
        table = tables.wait_for(lambda m: True, "the table")
        assert list(table.labels) == [7]
        names = table.geometries
        assert (list(names.source), list(names.frame), list(names.name)) == (
            ["cell"],
            ["world"],
            ["wall"],
        )
        client.forget(tables)


def test_a_camera_whose_frame_is_removed_is_stale(node, client):
    """The diagnostics say so, its topics are quiet; with a frame of that name it sees again."""
    depths = client.listen(Image, "cameras/spare/depth/image")
    depths.wait_for(lambda m: True, "an image")
    # Who loads a scene gets the tokens of its sources; those of the node's own scene nobody has.
    token = client.call("LoadScene", text=SCENE_OF_ANOTHER).sources[0].token
    owner = SourceHandle(name="guest", token=token)
    guest = client.listen(Image, "cameras/visitor/depth/image")
    guest.wait_for(lambda m: True, "an image of the guest's camera")
    answer = client.call("RemoveFrame", source=owner, frames=["mast"])
    assert answer.status.code == Status.OK
    diagnostics = client.listen(DiagnosticArray, "/diagnostics")

    def is_stale(message):
        return any(
            status.name.endswith("effect: camera visitor")
            and status.level == DiagnosticStatus.STALE
            and "has no frame 'mast'" in status.message
            for status in message.status
        )

    diagnostics.wait_for(is_stale, "a stale camera")

    def others_go_on():
        first = depths.count
        wait_until(lambda: depths.count >= first + 3, "images of another camera")

    # The last image may come later than the diagnostics.
    others_go_on()
    quiet = guest.count
    others_go_on()
    assert guest.count == quiet

    frame = FrameDescription(name="mast")
    frame.pose.orientation.w = 1.0
    assert client.call("RegisterFrame", source=owner, frames=[frame]).status.code == Status.OK
    wait_until(lambda: guest.count > quiet, "an image of the guest's camera again")
    for listener in (depths, guest, diagnostics):
        client.forget(listener)
    assert client.call("RemoveSource", source=owner).status.code == Status.OK
    wait_until(
        lambda: all(e.name != "camera visitor" for e in client.call("ListEffects").effects),
        "the end of the guest's camera",
    )


SCENE_OF_ANOTHER = """
version: 1
sources: [{name: guest}]
frames: [{name: mast, source: guest}]
cameras:
  - {name: visitor, source: guest, frame: mast, size: [4, 3], fov_y: 1, images: [depth]}
"""


def test_two_scenes_with_a_camera_of_one_name_are_refused(node, client):
    """Nothing of the second is there; with a prefix it is."""
    text = SCENE_OF_ANOTHER.replace("visitor", "eye")
    answer = client.call("LoadScene", text=text)
    assert answer.status.code == Status.NAME_CONFLICT
    assert "camera named 'eye'" in answer.status.message
    answer = client.call("LoadScene", text=text, prefix="b_")
    assert answer.status.code == Status.OK
    wait_until(lambda: "/scene_graph/cameras/b_eye/pose" in client.topics(), "the camera")
    assert client.call("RemoveSource", source=answer.sources[0]).status.code == Status.OK
