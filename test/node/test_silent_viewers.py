"""Sixteen viewers that read nothing cost the node a bounded memory, and nobody a contact."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
import re

from diagnostic_msgs.msg import DiagnosticArray
from foxglove_client import FoxgloveClient
from geometry_msgs.msg import Transform, Vector3
from node_harness import diagnostics_values, wait_until
import pytest
from sensor_msgs.msg import MultiDOFJointState

from scene_graph_msgs.msg import ContactArray
from scene_graph_ros.views.browser.waiting import MOST_WAITING

SCENE = """
version: 1
sources: [{name: cell}, {name: arm}]
frames: [{name: hand, source: arm}]
geometries:
  - {name: floor, source: cell, shape: {type: half_space}, roles: {proximity: {}}}
  - {name: ball, source: arm, frame: hand, shape: {type: sphere, radius: 0.25},
     roles: {illustration: {}, proximity: {}}}
  - {name: relief, source: cell, shape: {type: mesh, file: relief.obj}, roles: {illustration: {}}}
"""

TOPICS = ("/scene_graph/markers/illustration", "/scene_graph/contacts", "/diagnostics")
CLIENTS = 16
REQUESTS = 100
"""Of each client for the mesh: all answers together have 3 GB, if anybody keeps them."""

SLACK = 192 * 2**20
"""Bytes that the process may take beside those that wait: pieces of files, and Python's heap."""


@pytest.fixture(scope="module")
def mesh(tmp_path_factory):
    """The path of a mesh of 2 MB, most of them a remark, beside a scene that has it."""
    path = tmp_path_factory.mktemp("scene") / "relief.obj"
    path.with_name("scene.yaml").write_text(SCENE)
    remark = "# as long as a mesh of forty thousand triangles\n"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n" + 40_000 * remark)
    return path


@pytest.fixture(scope="module")
def node(start_node, mesh):
    """A node with a view."""
    scene = mesh.with_name("scene.yaml")
    node = start_node(
        {"scene": scene, "browser": True, "browser_port": 0, "diagnostics_rate": 20.0}
    )
    node.wait_for_output("browser view at ")
    return node


@pytest.fixture
def before(node):
    """The bytes of memory that the node has before anybody looks."""
    return resident(node)


@pytest.fixture
def silent(node, mesh, before) -> Iterator[list[FoxgloveClient]]:
    """Clients that ask for all that there is, and read no answer."""
    address = re.search(r"browser view at (http\S+)", node.output())[1]
    clients = []
    for _ in range(CLIENTS):
        viewer = FoxgloveClient(address, max_queue=1)
        clients.append(viewer)
        for number, topic in enumerate(TOPICS):
            viewer.subscribe(topic, number)
        for number in range(REQUESTS):
            viewer.say("fetchAsset", uri=mesh.as_uri(), requestId=number)
    yield clients
    for viewer in clients:
        viewer.socket.socket.close()  # To leave as the protocol has it, one has to read.


def resident(node):
    """Return the bytes of memory that a process has."""
    lines = Path(f"/proc/{node.process.pid}/status").read_text().splitlines()
    return next(1024 * int(line.split()[1]) for line in lines if line.startswith("VmRSS:"))


def test_contacts_go_on_and_memory_is_bounded_while_nobody_reads(node, client, before, silent):
    """Each pose has its contact, in order; too much never waits; who reads nothing is let go."""
    contacts = client.listen(ContactArray, "contacts")
    told = client.listen(DiagnosticArray, "/diagnostics")
    poses = client.publisher(MultiDOFJointState, "/arm/poses")
    wait_until(poses.get_subscription_count, "the node")
    seen = []

    def view():
        """Return what the node says of its view."""
        newest = told.newest
        values = {} if newest is None else diagnostics_values(newest, "browser")
        if values:
            seen.append(int(values["bytes that wait"]))
        return values

    def press(depth):
        """Put the ball, of radius 0.25 m, so deep into the floor, and wait for that contact."""
        message = MultiDOFJointState(joint_names=["hand"])
        message.header.stamp = client.now()
        transform = Transform(translation=Vector3(z=0.25 - depth))
        transform.rotation.w = 1.0
        message.transforms = [transform]
        poses.publish(message)
        wait_until(
            lambda: (
                contacts.newest is not None
                and [abs(point.depth - depth) < 1e-9 for point in contacts.newest.points] == [True]
            ),
            f"the contact of {depth} m",
        )

    step = 0

    def all_are_let_go():
        nonlocal step
        step += 1
        press(0.01 + 1e-5 * step)
        return int(view().get("clients cut off", 0)) == CLIENTS

    wait_until(all_are_let_go, "the end of all who read nothing")
    found = [point.depth for message in contacts.kept() for point in message.points]
    depths = [depth for depth in found if depth < 0.25]  # which it has at first
    assert depths == sorted(depths) and len(depths) >= min(step, 1000)
    assert 0 < max(seen) <= MOST_WAITING
    assert resident(node) - before < MOST_WAITING + SLACK
    wait_until(lambda: view()["bytes that wait"] == "0", "the end of what waits")
