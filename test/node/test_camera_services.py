"""Cameras by services while the node runs: topics come and go, and stay quiet without a frame."""

from __future__ import annotations

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from node_harness import wait_until
import numpy as np
import pytest
from scene_requests import camera, pose, sphere
from sensor_msgs.msg import Image

from scene_graph_msgs.msg import FrameDescription, RoleProperties, Status

START = "/scene_graph/cameras/"
TOPICS = {
    *("pose", "depth/image", "depth/image_raw", "depth/camera_info"),
    *("depth/image/compressedDepth", "depth/image_raw/compressedDepth"),
}


@pytest.fixture(scope="module")
def ask(start_node, client):
    """Ask a node that started with nothing in its scene, and be answered with OK."""
    start_node({"diagnostics_rate": 20.0})

    def call(service, **fields):
        answer = client.call(service, **fields)
        assert answer.status.code == Status.OK, answer.status
        return answer

    return call


@pytest.fixture(scope="module")
def rover(ask):
    """A source with a frame, and a ball a metre ahead of the world's origin: 0.75 m to it."""
    source = ask("RegisterSource", name="rover").source
    ask("RegisterFrame", source=source, frames=[FrameDescription(name="mast", pose=pose())])
    ball = sphere("ball", 0.25, pose(z=1.0), roles=[RoleProperties.PERCEPTION])
    ask("RegisterAnchoredGeometry", source=source, geometries=[ball])
    return source


def effects(ask):
    """Return what the node says about each effect."""
    return {effect.name: effect for effect in ask("ListEffects").effects}


def reason_of_camera(ask, name):
    """Return why a camera is on or off, or nothing where the node has not come to it yet."""
    effect = effects(ask).get(f"camera {name}")
    return "" if effect is None else effect.reason


def topics_of(client, name):
    """Return the topics of a camera."""
    start = f"{START}{name}/"
    return {topic.removeprefix(start) for topic in client.topics() if topic.startswith(start)}


def middle(image):
    """Return the depth that the second of three rows and the third of five columns has."""
    return np.frombuffer(bytes(image.data), np.float32).reshape(3, 5)[1, 2]


def registered(name, frame=""):
    """Return a camera whose middle pixel looks straight ahead: five columns, not four."""
    return camera(name, frame, width=5, rate=1000.0)


def test_a_camera_comes_and_goes(client, ask, rover):
    """Its topics with it; between them it sees, and is described."""
    ask("RegisterCamera", source=rover, cameras=[registered("eye", "mast")])
    wait_until(lambda: topics_of(client, "eye") == TOPICS, "the topics of the camera")
    depths = client.listen(Image, "cameras/eye/depth/image")
    assert middle(depths.wait_for(lambda m: True, "an image")) == np.float32(0.75)
    client.forget(depths)
    assert reason_of_camera(ask, "eye") == "the scene has it on frame rover/mast"
    (told,) = ask("DescribeScene").cameras
    assert (told.source, told.camera.name, told.camera.images) == ("rover", "eye", ["depth"])
    image = ask("RenderImages", camera="eye", images=["depth"]).depth[0]
    assert middle(image) == np.float32(0.75)

    ask("RemoveCamera", source=rover, cameras=["eye"])
    wait_until(lambda: not topics_of(client, "eye"), "the end of the camera's topics")
    wait_until(lambda: "camera eye" not in effects(ask), "the end of the camera")
    assert not ask("DescribeScene").cameras

    # The name is free again.
    ask("RegisterCamera", source=rover, cameras=[registered("eye", "mast")])
    wait_until(lambda: topics_of(client, "eye") == TOPICS, "the topics of the next camera")
    ask("RemoveCamera", source=rover, cameras=["eye"])


def test_a_camera_is_stale_while_its_frame_is_gone(client, ask, rover):
    """Diagnostics say so; it is listed all the while, and sees again with the frame."""
    frame = FrameDescription(name="arm", pose=pose(z=0.25))
    ask("RegisterFrame", source=rover, frames=[frame])
    ask("RegisterCamera", source=rover, cameras=[registered("hand", "arm")])
    depths = client.listen(Image, "cameras/hand/depth/image")
    assert middle(depths.wait_for(lambda m: True, "an image")) == np.float32(0.5)
    ask("RemoveFrame", source=rover, frames=["arm"])
    diagnostics = client.listen(DiagnosticArray, "/diagnostics")

    def is_stale(message):
        return any(
            status.name.endswith("effect: camera hand")
            and status.level == DiagnosticStatus.STALE
            and "source 'rover' has no frame 'arm'" in status.message
            for status in message.status
        )

    diagnostics.wait_for(is_stale, "a stale camera")
    assert [c.camera.description.frame for c in ask("DescribeScene").cameras] == ["arm"]
    refused = client.call("RenderImages", camera="hand", images=["depth"]).status
    assert refused.code == Status.UNKNOWN_NAME
    frame.pose = pose(z=0.5)
    ask("RegisterFrame", source=rover, frames=[frame])
    depths.wait_for(lambda m: middle(m) == np.float32(0.25), "an image from the new frame")
    for listener in (depths, diagnostics):
        client.forget(listener)
    ask("RemoveFrame", source=rover, frames=["arm"])
    # A camera without a frame can be removed like any other.
    ask("RemoveCamera", source=rover, cameras=["hand"])
    wait_until(lambda: not topics_of(client, "hand"), "the end of the camera's topics")


def test_a_camera_that_can_see_nothing_says_so(client, ask, rover):
    """Where no geometry has the perception role, as long as that is so."""
    ask("RegisterCamera", source=rover, cameras=[registered("blind")])
    ask("RemoveSource", source=rover)
    guest = ask("RegisterSource", name="guest").source
    ask("RegisterAnchoredGeometry", source=guest, geometries=[sphere("felt")])
    ask("RegisterCamera", source=guest, cameras=[registered("blind")])
    wait_until(
        lambda: "nothing has the perception role" in reason_of_camera(ask, "blind"),
        "a word about the role",
    )
    seen = sphere("seen", 0.25, pose(z=1.0), roles=[RoleProperties.PERCEPTION])
    ask("RegisterAnchoredGeometry", source=guest, geometries=[seen])
    wait_until(
        lambda: reason_of_camera(ask, "blind") == "the scene has it on the world",
        "no more of it",
    )
    ask("RemoveSource", source=guest)
    wait_until(lambda: not topics_of(client, "blind"), "the end of the camera's topics")
