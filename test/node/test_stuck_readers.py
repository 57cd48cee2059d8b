"""A viewer that is stopped costs the others nothing, and is told what it missed."""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
import json
from pathlib import Path
import signal
import subprocess
import sys
import tempfile
import threading

from geometry_msgs.msg import Quaternion, Transform, Vector3
from node_harness import DEADLINE, environment, ROOT, wait_until, WITH_ITS_PARENT
import pytest
from rclpy.qos import QoSProfile
from scene_requests import pose, reference, sphere
from sensor_msgs.msg import MultiDOFJointState
from visualization_msgs.msg import Marker, MarkerArray

from scene_graph_msgs.msg import ContactArray, FrameDescription, RoleProperties

TOPIC = "/scene_graph/markers/illustration"
POSE_RATE = 50.0
MARKER_RATE = 25.0
LEASE = 20.0
"""Seconds after which Fast DDS gives up who does not say that it is there."""

ROLES = (RoleProperties.ILLUSTRATION, RoleProperties.PROXIMITY)


class Reader:
    """A viewer in a process of its own, which may show something from the beginning."""

    def __init__(self, domain, shown=None):
        self._log = tempfile.NamedTemporaryFile("w+")  # noqa: SIM115 - lives as the process does
        script = ROOT / "test" / "support" / "marker_reader.py"
        self.process = subprocess.Popen(
            [*WITH_ITS_PARENT, sys.executable, str(script), TOPIC, json.dumps(shown or {})],
            env=environment(domain),
            stdout=self._log,
        )

    def states(self):
        """Return what it showed after each message."""
        text = Path(self._log.name).read_text()
        return [json.loads(line) for line in text.splitlines(keepends=True) if line[-1] == "\n"]

    def wait_for(self, condition, what):
        """Wait until what it shows now fulfils a condition."""
        wait_until(lambda: (states := self.states()) and condition(states[-1]), what)

    @contextlib.contextmanager
    def stopped(self):
        """Stop the process, as a debugger does or a machine that sleeps."""
        self.process.send_signal(signal.SIGSTOP)
        try:
            yield
        finally:
            self.process.send_signal(signal.SIGCONT)

    def close(self):
        """Kill it."""
        self.process.kill()
        self.process.wait()


@pytest.fixture(scope="module")
def node(start_node):
    """A node with an empty scene."""
    return start_node({"marker_rate": MARKER_RATE})


@pytest.fixture(scope="module")
def scene(client, node):
    """A ball that moves, and one that stands on a frame of its own."""
    source = client.call("RegisterSource", name="zoo").source
    frames = [FrameDescription(name=name, pose=pose()) for name in ("ball", "stone")]
    assert client.call("RegisterFrame", source=source, frames=frames).status.code == 0
    for name in ("ball", "stone"):
        request = {"source": source, "frame": name, "geometries": [sphere(name, roles=ROLES)]}
        assert client.call("RegisterGeometry", **request).status.code == 0
    return source


@pytest.fixture(scope="module")
def moving(client, scene) -> Iterator[None]:
    """The ball moves all the time."""
    publisher = client.publisher(MultiDOFJointState, "/zoo/poses")
    stop = threading.Event()

    def move():
        step = 0
        while not stop.wait(1.0 / POSE_RATE):
            step += 1
            transform = Transform(translation=Vector3(y=0.001 * step), rotation=Quaternion(w=1.0))
            message = MultiDOFJointState(joint_names=["ball"], transforms=[transform])
            message.header.stamp = client.now()
            publisher.publish(message)

    thread = threading.Thread(target=move)
    thread.start()
    yield
    stop.set()
    thread.join()


@pytest.fixture
def reader(domain, moving):
    """A viewer that has the whole scene."""
    reader = Reader(domain)
    reader.wait_for(lambda shown: len(shown) >= 2, "the viewer to show the scene")
    yield reader
    reader.close()


@pytest.fixture
def viewer(client, moving):
    """Another viewer, here, that has the whole scene."""
    viewer = client.listen(MarkerArray, TOPIC, QoSProfile(depth=100))
    viewer.wait_for(lambda m: len(m.markers) >= 2, "all markers")
    yield viewer
    client.forget(viewer)


@pytest.fixture
def contacts(client, moving):
    """A listener to contacts, which nobody ever held up: a clock for what the others get."""
    contacts = client.listen(ContactArray, "contacts")
    wait_until(lambda: contacts.count, "contacts")
    yield contacts
    client.forget(contacts)


def contacts_undisturbed(viewer, contacts):
    """Return how many contact messages come while a viewer gets 20 messages.

    At the rates that were asked for, or more: some of them may be lost here on a busy machine.
    """
    return max(contacts_while(viewer, contacts, 20), 20 * POSE_RATE / MARKER_RATE)


def contacts_while(viewer, contacts, messages):
    """Return how many contact messages come while a viewer gets so many messages."""
    markers, before = viewer.count, contacts.count
    wait_until(lambda: viewer.count >= markers + messages, f"{messages} messages with markers")
    return contacts.count - before


def test_others_get_their_markers_while_a_viewer_is_stopped(reader, viewer, contacts):
    """Two contact messages come for each of markers, as before; were it waited for, fifty."""
    undisturbed = contacts_undisturbed(viewer, contacts)
    with reader.stopped():
        assert contacts_while(viewer, contacts, 25) < 3 * undisturbed
        # Longer than anybody would have been waited for: nobody is waited for again.
        assert contacts_while(viewer, contacts, 25) < 3 * undisturbed


def test_others_get_their_markers_after_a_viewer_was_killed(reader, viewer, contacts):
    """It said no word, so that the middleware keeps it for many seconds more."""
    undisturbed = contacts_undisturbed(viewer, contacts)
    reader.process.kill()
    assert contacts_while(viewer, contacts, 50) < 5 * undisturbed


def test_a_newcomer_gets_the_whole_scene_while_another_is_stopped(client, reader, viewer):
    """Nothing tells whether the newcomer got it, so it is sent more than once."""
    with reader.stopped():
        wait_until(lambda: viewer.count >= 10, "markers")
        newcomer = client.listen(MarkerArray, TOPIC, QoSProfile(depth=5))
        newcomer.wait_for(lambda m: len(m.markers) >= 2, "all markers")
        before = len(newcomer.messages)
        wait_until(
            lambda: any(len(m.markers) >= 2 for m in list(newcomer.messages)[before:]),
            "all markers again",
        )
        client.forget(newcomer)


def remove_pebble(client, scene, viewer):
    """Remove the pebble while a viewer is stopped, who will never get the deletion itself."""
    removed = client.call("RemoveGeometry", source=scene, geometries=[reference("pebble")])
    assert removed.status.code == 0
    viewer.wait_for(
        lambda m: any(marker.action == Marker.DELETE for marker in m.markers),
        "the deletion, at the other viewer",
    )
    wait_for_more(viewer)


def wait_for_more(viewer):
    """Wait for more messages than the topic keeps."""
    before = viewer.count
    wait_until(lambda: viewer.count >= before + 20, "more markers")


@pytest.fixture
def pebble(client, scene, reader):
    """Something more, that the viewer shows."""
    request = {"source": scene, "frame": "stone", "geometries": [sphere("pebble", roles=ROLES)]}
    assert client.call("RegisterGeometry", **request).status.code == 0
    reader.wait_for(lambda shown: len(shown) == 3, "the pebble")


def test_a_viewer_that_goes_on_does_not_show_what_is_gone(client, scene, reader, viewer, pebble):
    """What was deleted while it was stopped is gone; what moved is where it is."""
    with reader.stopped():
        remove_pebble(client, scene, viewer)
    reader.wait_for(lambda shown: len(shown) == 2, "the end of the pebble")


def test_a_viewer_that_was_given_up_does_not_show_what_is_gone(
    client, domain, scene, reader, viewer, pebble
):
    """After so long a stop it is a newcomer to the middleware, but shows what it showed.

    Its part in the middleware begins anew in a process of its own. Whether Fast DDS finds again
    one that only goes on is chance: where that gives the node up a moment after the node heard of
    it again, neither tells the other its endpoints (of 12 viewers on a busy machine up to 5 stay
    without a message for good), and no node can mend that.
    """

    def is_known():
        infos = client.node.get_subscriptions_info_by_topic(TOPIC)
        return any(info.node_name == "marker_reader" for info in infos)

    wait_until(is_known, "the viewer to be known")
    with reader.stopped():
        remove_pebble(client, scene, viewer)
        wait_until(
            lambda: not is_known(),
            "the middleware to give up the viewer",
            LEASE + DEADLINE,
        )
        # The node may give it up a little later, and what it says on that occasion is then past.
        for _ in range(8):
            wait_for_more(viewer)
    reader.process.kill()
    returned = Reader(domain, reader.states()[-1])
    try:
        returned.wait_for(lambda shown: len(shown) == 2, "the end of the pebble")
    finally:
        returned.close()
