"""The node's view in a browser: what a page sees of a world that is edited and moved over DDS."""

from __future__ import annotations

from http.client import HTTPConnection
import io
from pathlib import Path
import re
import resource
import socket
import stat
from urllib.parse import urlsplit

from browser_page import PageClient
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import Pose, Quaternion, Transform, Vector3
from node_harness import DEADLINE, diagnostics_values, NodeProcess, wait_until
import numpy as np
from PIL import Image as Picture
import pytest
from rcl_interfaces.msg import ParameterEvent
from rcl_interfaces.srv import GetParameters
from sensor_msgs.msg import MultiDOFJointState
from websockets.exceptions import InvalidStatus

from msg_adapters.poses import multi_dof_joint_state_to_msg
from scene_graph_msgs.msg import (
    FrameDescription,
    GeometryDescription,
    GeometryReference,
    RoleProperties,
    Shape,
)
from scene_graph_msgs.srv import HasCollisions

BALL = Shape(kind=Shape.SPHERE, dimensions=[0.5])
UPRIGHT = Pose(orientation=Quaternion(w=1.0))


@pytest.fixture(scope="module")
def node(start_node):
    """A node with an empty scene, and a view on a port that is free."""
    return start_node(
        {"browser": True, "browser_port": 0, "browser_rate": 200.0, "diagnostics_rate": 20.0}
    )


@pytest.fixture(scope="module")
def address(node):
    """Where the log says that the view is."""
    node.wait_for_output("browser view at ")
    return re.search(r"browser view at (http://127\.0\.0\.1:\d+/)", node.output())[1]


@pytest.fixture
def page(address):
    """A page that looks."""
    page = PageClient(address)
    yield page
    page.close()


@pytest.fixture
def effect(client, node):
    """Return what a diagnostics message made after the call says of the view."""
    listener = client.listen(DiagnosticArray, "/diagnostics")

    def values():
        before = listener.count
        wait_until(lambda: listener.count >= before + 2, "diagnostics")
        return diagnostics_values(listener.newest, "effect: browser")

    yield values
    client.forget(listener)


def description(name):
    """Return a ball with both roles."""
    roles = [RoleProperties(role=RoleProperties.PROXIMITY)]
    roles.append(RoleProperties(role=RoleProperties.ILLUSTRATION))
    return GeometryDescription(name=name, shape=BALL, pose=UPRIGHT, roles=roles)


def test_a_page_sees_what_is_registered_moved_touching_and_removed(client, page, address):
    """From an empty world to a late page, one change after the other."""
    handle = client.call("RegisterSource", name="robot").source
    frames = [FrameDescription(name=name) for name in ("hand", "foot")]
    for frame, x in zip(frames, (0.0, 5.0), strict=True):
        frame.pose = Pose(orientation=Quaternion(w=1.0))
        frame.pose.position.x = x
    assert client.call("RegisterFrame", source=handle, frames=frames).status.code == 0
    for name in ("hand", "foot"):
        balls = [description(f"{name}_ball")]
        added = client.call("RegisterGeometry", source=handle, frame=name, geometries=balls)
        assert added.status.code == 0, added.status.message
    page.take_until(lambda: page.position("foot_ball") == [5, 0, 0])
    assert page.position("hand_ball") == [0, 0, 0]
    assert page.named("hand_ball")["path"] == ["illustration", "robot", "hand", "hand_ball"]

    publisher = client.publisher(MultiDOFJointState, "/robot/poses")
    message = MultiDOFJointState(joint_names=["foot"])
    message.header.stamp = client.now()
    message.transforms = [Transform(translation=Vector3(x=0.75), rotation=Quaternion(w=1.0))]
    publisher.publish(message)
    page.take_until(lambda: page.position("foot_ball") == [0.75, 0, 0])
    stamp = message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec
    assert page.time[0] == pytest.approx(stamp, abs=1e-6)

    # Two balls of radius 0.5, 0.75 apart: 0.25 deep, in the middle.
    page.wish(["proximity"], contacts=True)
    points, _, _, depths = page.take_until(lambda: page.contacts)
    assert points.tolist() == [pytest.approx([0.375, 0, 0], abs=1e-9)]
    assert depths.tolist() == [pytest.approx(0.25, abs=1e-6)]

    ball = GeometryReference(name="robot/hand/hand_ball")
    assert client.call("RemoveGeometry", source=handle, geometries=[ball]).status.code == 0
    page.take_until(lambda: page.named("hand_ball") is None)

    late = PageClient(address)
    late.take_until(lambda: late.position("foot_ball") == [0.75, 0, 0])
    assert len(late.items) == 1
    late.close()


def test_the_page_itself_is_served_to_browsers_only_as_ours(address):
    """By the address of the log; under somebody else's name it is not."""
    for host, status in ((None, 200), ("evil.example", 421)):
        connection = HTTPConnection(urlsplit(address).netloc)
        connection.request("GET", "/", headers={} if host is None else {"Host": host})
        response = connection.getresponse()
        assert response.status == status
        assert (b"<canvas" in response.read()) == (status == 200)
        connection.close()


def test_diagnostics_say_where_it_is_and_what_it_did(effect, address):
    """Nothing is made while no page is open."""
    wait_until(lambda: effect()["pages"] == "0", "the end of other tests' pages")
    before = effect()
    assert before["address"] == address
    assert effect()["messages"] == before["messages"]
    page = PageClient(address)
    page.take()
    assert wait_until(lambda: effect()["pages"] == "1", "the page")
    assert int(effect()["messages"]) > int(before["messages"])
    page.close()


def test_a_page_is_told_what_diagnostics_say(client, page):
    """A source that sent one message, of a frame that is not there, and no more: it is stale."""
    client.call("RegisterSource", name="ghost")
    publisher = client.publisher(MultiDOFJointState, "/ghost/poses")
    wait_until(publisher.get_subscription_count, "the node")
    message = MultiDOFJointState(joint_names=["nowhere"])
    message.header.stamp = client.now()
    message.transforms = [Transform(rotation=Quaternion(w=1.0))]
    publisher.publish(message)

    def trouble():
        return next((each for each in page.troubles if each["name"] == "source ghost"), None)

    page.take_until(lambda: trouble() is not None and trouble()["level"] == "stale")
    assert trouble()["text"].startswith("no poses for")


PRESSED = """
version: 1
sources: [{name: s}]
frames: [{name: f, source: s, pose: {xyz: [0, 0, 0.05]}}]
geometries:
  - name: floor
    source: s
    shape: {type: half_space}
    roles: {proximity: {hydroelastic: {compliance_type: rigid}}}
  - name: ball
    source: s
    frame: f
    shape: {type: sphere, radius: 0.1}
    roles:
      proximity:
        hydroelastic:
          {compliance_type: compliant, resolution_hint: 0.02, hydroelastic_modulus: 1e5}
"""


def test_surfaces_are_shown_where_something_presses(start_node, tmp_path):
    """A soft ball of 0.1 m, 0.05 m deep in a rigid floor: a disc on the floor, and no point.

    Its radius is that of the ball's section, sqrt(0.1^2 - 0.05^2) = 0.087 m. The tetrahedra, with
    edges of 0.02 m, are inside the ball: it is smaller, by less than such an edge.
    """
    (tmp_path / "pressed.yaml").write_text(PRESSED)
    node = start_node(
        {
            "scene": tmp_path / "pressed.yaml",
            "browser": True,
            "browser_port": 0,
            "pressure_scale": 2e4,
        },
        remaps=["__node:=pressed"],
    )
    node.wait_for_output("browser view at ")
    page = PageClient(re.search(r"browser view at (http\S+)", node.output())[1])
    page.wish(["proximity"], contacts=True)
    scale, corners, pressures = page.take_until(lambda: page.surfaces)
    assert scale == 2e4
    assert len(corners) == len(pressures) > 30
    # At 0.05 m below the top of the field, which is 0 outside and 1e5 Pa in the middle.
    assert pressures.min() >= 0.0
    assert 2.5e4 < pressures.max() <= 5.0e4 * (1.0 + 1e-6)
    assert abs(corners[:, 2]).max() < 1e-7
    radius = (corners[:, 0] ** 2 + corners[:, 1] ** 2).max() ** 0.5
    assert 0.067 < radius < 0.0867
    assert len(page.contacts[0]) == 0
    page.close()
    assert node.stop() == 0


def test_a_port_that_is_taken_ends_the_node_at_its_start(domain):
    """With one sentence and a code that says so: nobody looks for a page that is not there."""
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        node = NodeProcess(domain, {"browser": True, "browser_port": port})
        assert node.process.wait(timeout=DEADLINE) == 1
    last = node.output().strip().splitlines()[-1]
    assert last.startswith(
        f"scene_graph: OSError: browser_host '127.0.0.1' and browser_port {port}"
    )
    assert "browser_required false" in last
    assert "Traceback" not in node.output()


def test_a_port_that_is_taken_costs_the_view_alone_where_that_may_be(start_node, client):
    """The reason is in the log and in the diagnostics; the world goes on."""

    def failure(message):
        for status in message.status:
            if status.name.endswith("second: effect: browser"):
                return status.level == DiagnosticStatus.ERROR and status.message
        return None

    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        parameters = {"browser": True, "browser_port": port, "browser_required": False}
        node = start_node(parameters, remaps=["__node:=second"])
        node.wait_for_output(f"browser_port {port} can't be listened to")
        listener = client.listen(DiagnosticArray, "/diagnostics")
        found = listener.wait_for(failure, "the failure")
        assert f"browser_port {port} can't be listened to" in failure(found)
        answer = client.call_any(HasCollisions, "/second/has_collisions", HasCollisions.Request())
        assert answer.status.code == 0
        assert node.stop() == 0
    assert "Traceback" not in node.output()
    client.forget(listener)


def leads_to(node):
    """Return the file that opens the page, and the address in it."""
    node.wait_for_output("browser view at ")
    said = re.search(r"browser view at .*, opened with its token by (/\S+)", node.output())
    file = Path(said[1])
    return file, re.search(r'href="(http[^"]+)"', file.read_text())[1]


@pytest.mark.parametrize("given", ["new", "much-guarded"])
def test_a_token_is_in_a_file_of_the_user_and_nowhere_else(start_node, client, given):
    """Not in the log, nor in what parameters or their events say; the file goes with the node."""
    events = client.listen(ParameterEvent, "/parameter_events")
    node = start_node(
        {"browser": True, "browser_port": 0, "browser_token": given}, remaps=["__node:=guarded"]
    )
    file, link = leads_to(node)
    address, token = link.split("?token=")
    assert stat.S_IMODE(file.stat().st_mode) == 0o600
    assert (token == given) == (given != "new")
    assert len(token) > 10
    with pytest.raises(InvalidStatus):
        PageClient(address)
    page = PageClient(address, query=f"?token={token}")
    page.take()
    page.close()
    request = GetParameters.Request(names=["browser_token", "browser_host"])
    values = client.call_any(GetParameters, "/guarded/get_parameters", request).values
    assert [value.string_value for value in values] == ["set", "127.0.0.1"]
    assert all(token not in str(message) for message in events.kept())
    client.forget(events)
    assert node.stop() == 0
    assert token not in node.output()
    assert not file.exists()


def test_without_file_handles_one_sentence_is_said(start_node, client):
    """A limit of the handles that are open, and sixty connections: no traceback, and all go on."""
    node = start_node({"browser": True, "browser_port": 0}, remaps=["__node:=narrow"])
    node.wait_for_output("browser view at ")
    address = re.search(r"browser view at (http\S+)", node.output())[1]
    host, port = urlsplit(address).netloc.split(":")
    resource.prlimit(node.process.pid, resource.RLIMIT_NOFILE, (40, 4096))
    clients = [socket.create_connection((host, int(port)), timeout=60.0) for _ in range(60)]
    node.wait_for_output("raise the limit of 40")
    answer = client.call_any(HasCollisions, "/narrow/has_collisions", HasCollisions.Request())
    assert answer.status.code == 0
    for each in clients:
        each.close()
    assert node.stop() == 0
    assert node.output().count("raise the limit") == 1
    assert "Traceback" not in node.output()


def test_a_node_ends_in_order_with_open_pages(start_node):
    """Pages are cut off, and the process says that all was in order."""
    node = start_node({"browser": True, "browser_port": 0}, remaps=["__node:=third"])
    node.wait_for_output("browser view at ")
    address = re.search(r"browser view at (http\S+)", node.output())[1]
    page = PageClient(address)
    wait_until(lambda: page.socket.recv(timeout=60), "a message")
    assert node.stop() == 0
    page.wait_closed()
    page.close()


EYE = """
version: 1
sources: [{name: cell}, {name: arm}]
frames: [{name: hand, source: arm}]
geometries:
  - {name: wall, source: cell, pose: {xyz: [0, 0, 3]}, shape: {type: box, size: [9, 9, 1]},
     color: [1, 0, 0]}
cameras:
  - {name: eye, source: arm, frame: hand, size: [16, 12], clipping: [0.01, 10],
     intrinsics: {fx: 16, fy: 16, cx: 8, cy: 6}, depth_range: [0.1, 10], images: [color]}
  - {name: wide, source: arm, frame: hand, size: [1400, 3], clipping: [0.01, 10],
     intrinsics: {fx: 700, fy: 700, cx: 700, cy: 1}, depth_range: [0.1, 10], images: [color]}
"""


def size(file):
    """Return the width and height of a picture."""
    return Picture.open(io.BytesIO(file)).size


def test_a_page_sees_what_a_camera_sees(start_node, client, tmp_path):
    """In its colours, while it is asked for; nothing once the camera is beside the wall."""
    path = tmp_path / "scene.yaml"
    path.write_text(EYE)
    node = start_node(
        {"scene": path, "browser": True, "browser_port": 0}, remaps=["__node:=seeing"]
    )
    node.wait_for_output("browser view at ")
    page = PageClient(re.search(r"browser view at (http://127\.0\.0\.1:\d+/)", node.output())[1])
    page.take()
    assert page.scenes[-1]["cameras"] == ["eye", "wide"]
    assert page.picture is None
    page.wish(camera="eye")
    page.take_until(lambda: page.picture)

    def middle():
        pixels = np.asarray(Picture.open(io.BytesIO(page.picture)))
        assert pixels.shape == (12, 16, 3)
        return pixels[6, 8].tolist()

    assert middle() == [255, 0, 0]
    publisher = client.publisher(MultiDOFJointState, "/arm/poses")
    X = np.eye(4)
    X[0, 3] = 100.0
    stamp = client.node.get_clock().now().nanoseconds
    wait_until(publisher.get_subscription_count, "the node")
    publisher.publish(
        multi_dof_joint_state_to_msg(["hand"], X[None], stamp_ns=stamp, frame_id="world")
    )
    page.take_until(lambda: middle() != [255, 0, 0])
    page.wish(camera="wide")
    page.take_until(lambda: page.picture and size(page.picture) == (700, 2))
    page.picture = None
    page.wish(camera="nobody's")
    page.take_until(lambda: page.picture == b"")
    page.close()
