"""Recordings of a node that is moved, edited and killed: read by others, and replayed."""

from __future__ import annotations

import itertools
import math
import re
import resource
import signal
import subprocess
import sys
import threading

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Pose, Quaternion, Transform, Vector3
from node_harness import diagnostics_values, environment, ROOT, RUN_NODE, wait_until
import pytest
from rclpy.serialization import deserialize_message, serialize_message
from recordings import counted, DEADLINE, replay, size_of
from rosbags.rosbag2 import Reader
from sensor_msgs.msg import JointState, MultiDOFJointState
from visualization_msgs.msg import MarkerArray

from msg_adapters.definitions import definition_with_parts
from scene_graph_msgs.msg import (
    ContactArray,
    FrameDescription,
    GeometryDescription,
    RoleProperties,
    Shape,
)
from scene_graph_ros.geometry import Role, SceneGraph
from scene_graph_ros.node.recording.bag import Bag
from scene_graph_ros.node.recording.events import encode, VERSION
from scene_graph_ros.replay.reader import RecordingError, RecordingReader
from scene_graph_ros.scene_files import load_scene

CELL = ROOT / "config" / "scenes" / "panda_cell.yaml"
JOINTS = [f"panda_joint{number}" for number in range(1, 8)]


def move_robot(client, steps, start=0):
    """Send joint positions of the Panda, and wait until the last of them counts."""
    publisher = client.publisher(JointState, "/joint_states")
    for step in range(start, start + steps):
        message = JointState(name=JOINTS)
        message.header.stamp = client.now()
        message.position = [0.8 * math.sin(0.05 * step + joint) for joint in range(7)]
        publisher.publish(message)
        if step % 10 == 9:
            # No more at once than the middleware keeps.
            answer = client.call("HasCollisions", options=options(message.header.stamp))
            assert answer.status.code == 0, answer.status
    client.destroy(publisher)


def options(stamp):
    """Return those of a query that waits for poses of a stamp."""
    from builtin_interfaces.msg import Duration

    from scene_graph_msgs.msg import QueryOptions

    return QueryOptions(minimal_stamp=stamp, timeout=Duration(sec=20))


def add_ball(client, name):
    """Register a source with a frame that has a ball, and move it; all by the services."""
    handle = client.call("RegisterSource", name=name).source
    frame = FrameDescription(name="f", pose=Pose(orientation=Quaternion(w=1.0)))
    assert client.call("RegisterFrame", source=handle, frames=[frame]).status.code == 0
    ball = GeometryDescription(
        name="ball",
        shape=Shape(kind=Shape.SPHERE, dimensions=[0.3]),
        pose=Pose(orientation=Quaternion(w=1.0)),
        roles=[RoleProperties(role=RoleProperties.PROXIMITY)],
    )
    # Refused: what it took of ids is gone in the replay, too.
    assert client.call("RegisterGeometry", source=handle, frame="f", geometries=[ball, ball])
    answer = client.call("RegisterGeometry", source=handle, frame="f", geometries=[ball])
    assert answer.status.code == 0, answer.status
    publisher = client.publisher(MultiDOFJointState, f"/{name}/poses")
    message = MultiDOFJointState(joint_names=["f"])
    message.header.stamp = client.now()
    message.transforms = [Transform(translation=Vector3(x=0.5, z=0.5), rotation=Quaternion(w=1.0))]
    publisher.publish(message)
    found = client.call("HasCollisions", options=options(message.header.stamp))
    assert found.status.code == 0, found.status
    client.destroy(publisher)
    return handle


def test_what_is_grasped_while_the_robot_moves_is_where_it_was(
    start_node, client, domain, tmp_path
):
    """Attached and let go where the hand is when the edit begins; updates do not wait for it."""
    folder = tmp_path / "bag"
    node = start_node({"scene": CELL, "record": folder})
    handle = add_ball(client, "guest")
    publisher = client.publisher(JointState, "/joint_states")
    is_over = threading.Event()

    def go_on():
        for step in itertools.count():
            message = JointState(name=JOINTS)
            message.header.stamp = client.now()
            message.position = [0.8 * math.sin(0.02 * step + joint) for joint in range(7)]
            publisher.publish(message)
            if is_over.wait(0.002):
                return

    mover = threading.Thread(target=go_on)
    mover.start()
    try:
        grasp = {"source": handle, "frame": "f"}
        for _ in range(10):
            attached = client.call("AttachFrame", link="panda_hand", **grasp)
            assert attached.status.code == 0, attached.status
            assert client.call("DetachFrame", **grasp).status.code == 0
    finally:
        is_over.set()
        mover.join()
    assert node.stop() == 0
    client.destroy(publisher)
    code, said = replay(domain, folder, "--check")
    assert code == 0, said
    _, edits, updates, equal, _, different = counted(said)
    assert (edits, different) == (23, 0), said
    assert equal >= updates > 20


def test_an_ordinary_end_leaves_a_bag_that_rosbags_reads(start_node, domain, tmp_path):
    """Nobody listened: the recording itself asks for contacts and for the whole scene."""
    folder = tmp_path / "deep" / "bag"
    node = start_node({"scene": CELL, "record": folder})
    wait_until(lambda: size_of(folder) > 10_000, "the first chunk")
    assert node.stop() == 0
    with Reader(folder) as bag:
        topics = {c.topic: c for c in bag.connections}
        markers = topics["/scene_graph/markers/proximity"]
        first = next(bag.messages([markers]))
    assert topics["/scene_graph/contacts"].msgcount > 0
    assert markers.ext.offered_qos_profiles[0].durability.name == "TRANSIENT_LOCAL"
    graph = SceneGraph()
    load_scene(CELL).apply(graph)
    scene = deserialize_message(bytes(first[2]), MarkerArray)
    shown = graph.model_inspector().num_geometries_with_role(Role.PROXIMITY)
    assert len(scene.markers) == shown
    code, said = replay(domain, folder, "--check")
    assert code == 0, said
    assert counted(said)[5] == 0


def test_a_full_disk_ends_the_recording_and_not_the_node(start_node, client, domain, tmp_path):
    """What was whole before is replayed; diagnostics say what happened."""
    folder = tmp_path / "bag"
    node = start_node({"scene": CELL, "record": folder, "diagnostics_rate": 20.0})
    wait_until(lambda: size_of(folder) > 10_000, "the first chunk")
    # Each write beyond a size fails, as on a disk that is full.
    limit = 100_000
    resource.prlimit(node.process.pid, resource.RLIMIT_FSIZE, (limit, limit))
    diagnostics = client.listen(DiagnosticArray, "/diagnostics")

    def failed(message):
        entry = [s for s in message.status if s.name.endswith("effect: record")]
        return entry and "the recording ended" in entry[0].message

    publisher = client.publisher(JointState, "/joint_states")
    step = 0

    def moved_until_full():
        nonlocal step
        step += 1
        message = JointState(name=JOINTS, position=[0.1 * math.sin(step + j) for j in range(7)])
        message.header.stamp = client.now()
        publisher.publish(message)
        return diagnostics.newest and failed(diagnostics.newest)

    wait_until(moved_until_full, "the recording's failure")
    assert "File too large" in str(diagnostics.newest)
    values = diagnostics_values(diagnostics.newest, "effect: record")
    assert values["folder"] == str(folder)
    assert 0 < size_of(folder) <= limit
    assert client.call("HasCollisions").status.code == 0
    assert node.is_alive()
    client.destroy(publisher)
    client.forget(diagnostics)
    code, said = replay(domain, folder, "--check")
    assert code == 0, said
    assert counted(said)[3] > 0
    assert counted(said)[5] == 0
    assert "the recording ended" in node.output()
    assert node.stop() == 4


def test_a_folder_that_is_there_is_not_overwritten(domain, tmp_path):
    """The node says so and does not start."""
    (tmp_path / "mine").write_text("kept")
    done = subprocess.run(
        [sys.executable, "-c", RUN_NODE, "--ros-args", "-p", f"record:={tmp_path}"],
        env=environment(domain),
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=DEADLINE,
        check=False,
    )
    assert done.returncode == 1
    assert f"{tmp_path} exists already" in done.stderr
    assert (tmp_path / "mine").read_text() == "kept"


def damaged(folder):
    """Make a recording whose first chunk is not what it says."""
    folder.mkdir()
    magic = b"\x89MCAP0\r\n"
    (folder / "a.mcap").write_bytes(magic + b"\x06" + (40).to_bytes(8, "little") + b"\xff" * 40)


@pytest.mark.parametrize(
    ("make", "reason"),
    [
        (lambda folder: None, "no folder"),
        (lambda folder: folder.mkdir(), "has 0 .mcap files"),
        (
            lambda folder: (folder.mkdir(), (folder / "a.mcap").write_bytes(b"hello there")),
            "is no MCAP file",
        ),
        (damaged, "damaged before byte"),
    ],
)
def test_what_is_no_recording_is_refused_with_the_reason(domain, tmp_path, make, reason):
    """Exit code 2, and one line."""
    folder = tmp_path / "bag"
    make(folder)
    code, said = replay(domain, folder, "--check")
    assert (code, len(said.splitlines())) == (2, 1), said
    assert reason in said
    assert str(folder) in said
    page = tmp_path / "page.html"
    assert replay(domain, folder, "--html", page)[0] == 2
    assert not page.exists()


def schema_alone(folder, kind, definition):
    """Make a recording that describes one type of messages and has no message of it."""

    def text(words):
        return len(words.encode()).to_bytes(4, "little") + words.encode()

    def record(code, content):
        return bytes([code]) + len(content).to_bytes(8, "little") + content

    folder.mkdir()
    schema = (1).to_bytes(2, "little") + text(kind) + text("ros2msg") + text(definition)
    magic = b"\x89MCAP0\r\n"
    (folder / "a.mcap").write_bytes(magic + record(3, schema) + record(15, bytes(4)) + magic)


CONTACTS = "scene_graph_msgs/msg/ContactArray"


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda text: f"float64 new\n{text}", f"{CONTACTS} had other fields than it has now"),
        (  # of a part
            lambda text: re.sub(
                r"(MSG: scene_graph_msgs/\w+\n)", r"\1float64 new\n", text, count=1
            ),
            r"scene_graph_msgs/msg/\w+ had other fields than it has now",
        ),
        (lambda text: "???", f"{CONTACTS} is described in no way that is known"),
    ],
)
def test_messages_of_other_fields_are_not_read(tmp_path, change, reason):
    """The file and the type are named."""
    schema_alone(tmp_path / "bag", CONTACTS, change(definition_with_parts(CONTACTS)))
    with pytest.raises(RecordingError, match=f"^{tmp_path}/bag/a.mcap: {reason}"):
        list(RecordingReader(tmp_path / "bag"))


def test_messages_of_other_fields_are_not_replayed(domain, tmp_path):
    """Whatever is to be done with them: one line, and no file."""
    folder, file = tmp_path / "bag", tmp_path / "new"
    schema_alone(folder, CONTACTS, "float64 other")
    for how in ([], ["--check"], ["--html", file], ["--repair", file]):
        code, said = replay(domain, folder, *how)
        assert (code, len(said.splitlines())) == (2, 1), said
        assert f"replay: {folder}/a.mcap: {CONTACTS} had other fields" in said
        assert not file.exists()


def test_constants_and_comments_may_be_others(tmp_path):
    """As those that newer versions add; and types that are gone are told."""
    text = definition_with_parts(CONTACTS)
    schema_alone(tmp_path / "new", CONTACTS, f"# A comment\nuint8 LATER=7\n{text}")
    assert list(RecordingReader(tmp_path / "new")) == []
    schema_alone(tmp_path / "gone", "scene_graph_msgs/msg/Gone", "float64 x")
    with pytest.raises(RecordingError, match="scene_graph_msgs/msg/Gone is not there any more"):
        list(RecordingReader(tmp_path / "gone"))
    # Others' messages are published by who installed them.
    schema_alone(tmp_path / "others", "other_msgs/msg/Other", "float64 x")
    assert list(RecordingReader(tmp_path / "others")) == []


def test_events_of_other_versions_are_not_replayed(domain, tmp_path):
    """Those of a version before, and an edit whose request had other fields than it has now."""
    parameters = {"package_paths": "", "world_frame": "world", "accuracy": "standard"}
    told = {"id": 10**6, "parameters": parameters, "path": "", "text": "", "given": False}
    request = {"service": "RegisterSource", "id": 10**6, "path": "", "text": "", "request": ""}
    asked = encode("edit", layout="0" * 16, **request, ids=[], rehung={})
    for name, events, reason in (
        ("old", [encode("begin", version=1, **told)], f"has version 1, this replays {VERSION}"),
        (
            "edited",
            [encode("begin", version=VERSION, **told), asked],
            "the request of RegisterSource at 2 ns has other fields than such requests have now",
        ),
    ):
        bag = Bag(tmp_path / name, 1)
        for time, event in enumerate(events, start=1):
            bag.write("/events", "std_msgs/msg/String", None, time, event)
        bag.close()
        code, said = replay(domain, tmp_path / name, "--check")
        assert (code, len(said.splitlines())) == (2, 1), said
        assert reason in said


def test_a_pace_of_moments_is_for_a_page(domain, tmp_path):
    """Nothing is ignored without a word."""
    code, said = replay(domain, tmp_path, "--check", "--fps", "10")
    assert code == 2
    assert "--fps is for --html FILE" in said


def test_a_killed_node_leaves_what_is_replayed_bit_for_bit(start_node, client, domain, tmp_path):
    """The Panda's cell, moved and edited: contacts of the replay are those that went out.

    The last test: for a while a client takes the killed node's services for those of the next one.
    """
    folder = tmp_path / "bag"
    node = start_node({"scene": CELL, "record": folder})
    heard = client.listen(ContactArray, "contacts")
    move_robot(client, 100)
    handle = add_ball(client, "guest")
    move_robot(client, 100, start=100)
    last = wait_until(lambda: heard.newest, "contacts")
    stamps = {bytes(serialize_message(last.header.stamp))}
    before = size_of(folder)
    wait_until(lambda: size_of(folder) > before, "another chunk")
    before = size_of(folder)
    wait_until(lambda: size_of(folder) > before, "the chunk after it")
    assert node.stop(signal.SIGKILL) != 0
    client.forget(heard)

    code, said = replay(domain, folder, "--check", fresh=True)
    assert code == 0, said
    assert "was cut off" in said
    inputs, edits, updates, equal, _, different = counted(said)
    assert (inputs, edits, different) == (201, 3, 0), said
    assert updates > 3
    assert equal >= updates

    reader = RecordingReader(folder)
    recorded = list(reader)
    assert not reader.is_complete
    assert [m.time for m in recorded] == sorted({m.time for m in recorded})
    contacts = [m.data for m in recorded if m.kind.endswith("/ContactArray")]
    assert any(
        bytes(serialize_message(deserialize_message(data, ContactArray).header.stamp)) in stamps
        for data in contacts
    )
    assert str(handle.token).encode() not in b"".join(m.data for m in recorded)

    page = tmp_path / "page.html"
    code, said = replay(domain, folder, "--html", page)
    assert code == 0, said
    assert str(page) in said
    moments = counted(said)[0]
    assert 3 < moments <= updates
    content = page.read_text()
    assert content.count("</script>") == 2
    code, said = replay(domain, folder, "--html", page)
    assert code == 2, said
    assert str(page) in said
    assert page.read_text() == content

    repaired = tmp_path / "repaired"
    code, said = replay(domain, folder, "--repair", repaired)
    assert code == 0, said
    with Reader(repaired) as bag:
        read = [(c.topic, c.msgtype, t, bytes(data)) for c, t, data in bag.messages()]
    assert read == [(m.topic, m.kind, m.time, m.data) for m in recorded]
    code, said = replay(domain, repaired, "--check")
    assert code == 0, said
    assert "was cut off" not in said
