"""`python -m scene_graph_ros.record` beside a node: others read what it writes."""

from __future__ import annotations

from pathlib import Path
import re
import signal
import tempfile

from forked import ForkedProcess
from geometry_msgs.msg import Transform, Vector3
from node_harness import environment, wait_until
import pytest
from rclpy.serialization import deserialize_message
from recordings import replay
from rosbags.rosbag2 import Reader
from sensor_msgs.msg import MultiDOFJointState
from visualization_msgs.msg import MarkerArray

from scene_graph_msgs.msg import ContactArray

SCENE = """
version: 1
sources: [{name: arm}]
frames: [{name: hand, source: arm}]
geometries:
  - {name: ball, source: arm, frame: hand, shape: {type: sphere, radius: 0.25},
     roles: {illustration: {}, proximity: {}}}
  - {name: floor, source: arm, shape: {type: half_space}, roles: {proximity: {}}}
"""


RECORD = """
import sys
from scene_graph_ros.record import main
sys.exit(main())
"""


class Command:
    """The command as a process, which has the long imports behind it."""

    def __init__(self, domain, *arguments):
        self._log = tempfile.NamedTemporaryFile("r", suffix=".log")  # noqa: SIM115
        self._line = ""
        log = Path(self._log.name)
        self.process = ForkedProcess(RECORD, [*map(str, arguments)], environment(domain), log)

    def _next_line(self):
        """Return the next line of the output, None where it is not there yet."""
        self._line += self._log.readline()
        if not self._line.endswith("\n"):
            return None
        line, self._line = self._line, ""
        return line

    def wait_for_line(self, pattern):
        """Return what a line of the output has that matches."""

        def found():
            has_ended = self.process.poll() is not None
            while line := self._next_line():
                if match := re.search(pattern, line):
                    return match
            assert not has_ended, f"it ended with {self.process.returncode}, without {pattern!r}"
            return None

        return wait_until(found, f"{pattern!r} in the command's output")

    def wait_for_counts(self):
        """Return of how many topics and publishers it says next that it records them."""
        line = r"recording (\d+) topics of /scene_graph, from (\d+) publishers"
        found = self.wait_for_line(line)
        return int(found[1]), int(found[2])

    def wait_for_end(self):
        """Return its exit code and the rest of what it said."""
        try:
            return self.process.wait(60.0), self._line + self._log.read()
        finally:
            self.process.kill()

    def end(self):
        """Interrupt it; return its exit code and the rest of what it said."""
        self.process.send_signal(signal.SIGINT)
        return self.wait_for_end()


@pytest.fixture
def node(start_node, tmp_path):
    """A node with a ball above a floor."""
    (tmp_path / "scene.yaml").write_text(SCENE)
    return start_node({"scene": tmp_path / "scene.yaml"})


def test_what_a_running_node_does_is_recorded(node, client, domain, tmp_path):
    """Inputs, contacts and markers, whole at first; rosbags reads it, and it is published."""
    folder = tmp_path / "recording"
    command = Command(domain, folder)
    # Markers of three roles, contacts, their markers, diagnostics; poses, which nobody sends yet.
    while command.wait_for_counts() != (7, 6):
        pass
    publisher = client.publisher(MultiDOFJointState, "/arm/poses")
    # The node and the command know of it, and the command that it is heard.
    wait_until(lambda: publisher.get_subscription_count() == 2, "both")
    assert command.wait_for_counts() == (7, 7)
    sent = []
    contacts = client.listen(ContactArray, "/scene_graph/contacts")
    for step in range(20):
        message = MultiDOFJointState(joint_names=["hand"])
        message.header.stamp = client.now()
        transform = Transform(translation=Vector3(z=0.125 + 0.001 * step))
        transform.rotation.w = 1.0
        message.transforms = [transform]
        publisher.publish(message)
        sent.append(message.header.stamp)
        contacts.wait_for(lambda m, at=sent[-1]: m.header.stamp == at, "its contacts")
    code, said = command.end()
    assert code == 0, said
    assert " 0 dropped" in said
    read = {}
    with Reader(folder) as reader:
        for connection, _, data in reader.messages():
            read.setdefault(connection.topic, []).append(data)
    poses = [deserialize_message(d, MultiDOFJointState) for d in read["/arm/poses"]]
    assert [each.header.stamp for each in poses] == sent
    depths = {}
    for data in read["/scene_graph/contacts"]:
        message = deserialize_message(data, ContactArray)
        stamp = message.header.stamp
        depths[stamp.sec, stamp.nanosec] = [point.depth for point in message.points]
    for step, at in enumerate(sent):
        # A ball of 0.25 m, whose middle is 0.125 m above the floor, and rises.
        (depth,) = depths[at.sec, at.nanosec]
        assert depth == pytest.approx(0.125 - 0.001 * step, abs=1e-12)
    first = deserialize_message(read["/scene_graph/markers/proximity"][0], MarkerArray)
    assert len(first.markers) == 2
    client.forget(contacts)
    client.destroy(publisher)
    code, said = replay(domain, folder, "--check")
    assert code == 2
    assert "recorded beside /scene_graph, which ran already" in said
    code, said = replay(domain, folder, "--rate", "100")
    assert code == 0
    assert int(said.split()[0]) >= len(read["/scene_graph/contacts"])
    assert "exists already" in Command(domain, folder).wait_for_end()[1]


def test_it_waits_for_its_node_and_ends_where_it_is_full(domain, tmp_path):
    """A node that is not there is waited for; a limit below the first message ends it."""
    command = Command(domain, tmp_path / "waiting", "--node", "nobody")
    command.wait_for_line("waiting for /nobody")
    assert command.end()[0] == 0
    full = Command(domain, tmp_path / "full", "--max-bytes", "10")
    code, said = full.wait_for_end()
    assert code == 1
    assert "10, and ended" in said
