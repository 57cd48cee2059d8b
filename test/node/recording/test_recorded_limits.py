"""Recordings that reach a limit; surfaces, scenes that are loaded, and what is shown again."""

from __future__ import annotations

import random
import string
import subprocess
import sys
import threading

from cloud_messages import cloud_message
from diagnostic_msgs.msg import DiagnosticArray
from node_harness import diagnostics_values, environment, ROOT, wait_until
import numpy as np
from page_files import FileReader
import pytest
from recordings import counted, replay, size_of
from rosbags.rosbag2 import Reader
from sensor_msgs.msg import PointCloud2
from visualization_msgs.msg import MarkerArray

from msg_adapters.deformables import configurations_to_msg
from scene_graph_msgs.msg import ContactArray, DeformableConfigurations
from scene_graph_ros.node.recording import spool
from scene_graph_ros.node.recording.events import decode, encode
from scene_graph_ros.replay.reader import RecordingReader

TEXT = "std_msgs/msg/String"
PRESSED = """
version: 1
sources: [{name: s}]
frames: [{name: f, source: s, pose: {xyz: [0, 0, 0.13]}}]
geometries:
  - name: plate
    source: s
    shape: {type: box, size: [1, 1, 0.1]}
    roles: {proximity: {hydroelastic: {compliance_type: rigid, resolution_hint: 0.1}}}
  - name: ball
    source: s
    frame: f
    shape: {type: sphere, radius: 0.1}
    roles:
      proximity:
        hydroelastic: {compliance_type: compliant, resolution_hint: 0.1, hydroelastic_modulus: 1e5}
"""
SOFT = """
version: 1
sources: [{name: cell}, {name: sim}]
geometries:
  - {name: floor, source: cell, shape: {type: half_space}, roles: {proximity: {}}}
  - name: sponge
    source: sim
    pose: {xyz: [0, 0, 0.2]}
    shape: {type: box, size: [0.2, 0.3, 0.1]}
    deformable: {resolution_hint: 0.1}
"""
SEEN = """
version: 1
sources: [{name: camera}, {name: other}]
frames: [{name: hand, source: other}]
geometries:
  - {name: ball, source: other, frame: hand, shape: {type: sphere, radius: 0.125}}
  - {name: seen, source: camera, shape: {type: point_cloud, radius: 0.125}}
"""
BALLS = """
version: 1
sources: [{name: balls}]
geometries:
  - {name: a, source: balls, shape: {type: sphere, radius: 0.1}}
"""


def test_compliant_and_loaded_geometry_is_replayed(start_node, client, domain, tmp_path):
    """Contact surfaces, and a scene that a request brought; then all of it is published again."""
    folder = tmp_path / "bag"
    (tmp_path / "scene.yaml").write_text(PRESSED)
    node = start_node({"scene": tmp_path / "scene.yaml", "record": folder})
    listener = client.listen(ContactArray, "contacts")
    listener.wait_for(lambda message: message.surfaces, "contact surfaces")
    (tmp_path / "balls.yaml").write_text(BALLS)
    answer = client.call("LoadScene", resource=str(tmp_path / "balls.yaml"))
    assert answer.status.code == 0, answer.status
    version = answer.scene_version
    listener.wait_for(lambda message: message.scene_version == version, "contacts with it")
    client.forget(listener)
    assert node.stop() == 0
    # The replay has the text from the recording.
    (tmp_path / "balls.yaml").unlink()
    code, said = replay(domain, folder, "--check")
    assert code == 0, said
    _, edits, _, equal, late, different = counted(said)
    assert (edits, different) == (1, 0), said
    assert equal > late

    page = tmp_path / "page.html"
    code, said = replay(domain, folder, "--html", page)
    assert code == 0, said
    reader = FileReader(page.read_text())
    reader.go(counted(said)[0] - 1)
    scale, corners, pressures = reader.surfaces
    assert len(corners) == len(pressures) > 0
    assert 0.0 < pressures.max() < scale

    # Published again, for whoever listens by then.
    command = [sys.executable, "-m", "scene_graph_ros.replay", str(folder), "--rate", "20"]
    contacts = client.node.create_subscription(
        ContactArray, "/scene_graph/contacts", (got := []).append, 10
    )
    markers = client.node.create_subscription(
        MarkerArray, "/scene_graph/markers/proximity", (seen := []).append, 10
    )
    done = subprocess.run(
        command,
        env=environment(domain),
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "messages published" in done.stdout
    wait_until(lambda: seen and got and any(m.surfaces for m in got), "what is published again")
    client.destroy(contacts)
    client.destroy(markers)


def test_configurations_are_replayed(start_node, client, domain, tmp_path):
    """A sponge that comes down on a floor: its contacts are those that went out."""
    folder = tmp_path / "bag"
    (tmp_path / "soft.yaml").write_text(SOFT)
    node = start_node({"scene": tmp_path / "soft.yaml", "record": folder})
    publisher = client.publisher(DeformableConfigurations, "/sim/configurations")
    answer = client.call("GetDeformableConfigurations")
    start = np.array(answer.configurations.positions).reshape(-1, 3)
    contacts = client.listen(ContactArray, "contacts")
    for depth in (0.01, 0.02, 0.03):
        down = start - np.array((0.0, 0.0, start[:, 2].min() + depth))
        message = configurations_to_msg({"sponge": down}, stamp_ns=0, frame_id="world")
        message.header.stamp = stamp = client.now()
        publisher.publish(message)
        contacts.wait_for(
            lambda m, stamp=stamp: m.header.stamp == stamp and m.deformables, "the contact"
        )
    client.forget(contacts)
    client.destroy(publisher)
    assert node.stop() == 0
    code, said = replay(domain, folder, "--check")
    assert code == 0, said
    inputs, _, _, equal, late, different = counted(said)
    assert (inputs, different) == (3, 0), said
    assert equal >= late + 3

    page = tmp_path / "page.html"
    code, said = replay(domain, folder, "--html", page)
    assert code == 0, said
    reader = FileReader(page.read_text())
    reader.go(counted(said)[0] - 1)
    vertices = reader.vertices[reader.named("sponge", "proximity")["number"]]
    # Of its surface, in an order of their own: each is one of the mesh's.
    far = np.linalg.norm(vertices[:, None] - down, axis=2).min(axis=1)
    assert far.max() < 1e-6
    assert vertices[:, 2].min() == pytest.approx(-0.03, abs=1e-6)


def test_points_are_replayed(start_node, client, domain, tmp_path):
    """A point that comes nearer to a ball: the contacts are those that went out."""
    folder = tmp_path / "bag"
    (tmp_path / "seen.yaml").write_text(SEEN)
    options = {"scene": tmp_path / "seen.yaml", "record": folder, "max_points_per_cloud": 2}
    node = start_node(options)
    publisher = client.publisher(PointCloud2, "/camera/points")
    contacts = client.listen(ContactArray, "contacts")
    for height in (0.1875, 0.125):
        message = cloud_message([[0.0, 0.0, height]], "other/hand")
        message.header.stamp = stamp = client.now()
        publisher.publish(message)
        contacts.wait_for(lambda m, stamp=stamp: m.header.stamp == stamp and m.points, "a contact")
    # One that is refused, which the replay is to refuse as well.
    message = cloud_message(np.zeros((3, 3)))
    message.header.stamp = client.now()
    publisher.publish(message)
    client.call("RegisterSource", name="new")
    message = cloud_message([[0.0, 0.0, 0.15625]], "other/hand")
    message.header.stamp = stamp = client.now()
    publisher.publish(message)
    contacts.wait_for(lambda m: m.header.stamp == stamp and m.points, "the last contact")
    client.forget(contacts)
    client.destroy(publisher)
    assert node.stop() == 0
    code, said = replay(domain, folder, "--check")
    assert code == 0, said
    inputs, edits, _, equal, late, different = counted(said)
    assert (inputs, edits, different) == (4, 1, 0), said
    assert equal >= late + 3


def test_a_replay_of_other_files_differs(start_node, domain, tmp_path):
    """The check can fail: a recording whose scene says another radius has other contacts."""
    scene, folder, changed = (tmp_path / name for name in ("s.yaml", "bag", "changed"))
    scene.write_text(
        BALLS + "  - {name: b, source: balls, frame: f, shape: {type: sphere, radius: 0.1}}\n"
        "frames: [{name: f, source: balls, pose: {xyz: [0.15, 0, 0]}}]\n"
    )
    node = start_node({"scene": scene, "record": folder})
    wait_until(lambda: size_of(folder) > 1000, "the first chunk")
    assert node.stop() == 0
    code, said = replay(domain, folder, "--check")
    assert (code, counted(said)[5]) == (0, 0), said
    from scene_graph_ros.node.recording.bag import Bag

    recorded = list(RecordingReader(folder))
    bag = Bag(changed, recorded[0].time)
    from rosbags.rosbag2.metadata import parse_qos

    for message in recorded:
        data = message.data
        if message.kind == TEXT and (event := decode(data))["event"] == "begin":
            event["text"] = event["text"].replace("radius: 0.1}", "radius: 0.11}")
            data = encode(event.pop("event"), **event)
        profiles = parse_qos(message.qos) if message.qos else []
        bag.copy(message.topic, message.kind, profiles, message.time, data)
    bag.close()
    code, said = replay(domain, changed, "--check")
    assert code == 1, said
    assert counted(said)[5] > 0


def test_the_size_limit_ends_a_recording_in_order(start_node, client, domain, tmp_path):
    """It has an index, and diagnostics say that it is over."""
    folder, limit = tmp_path / "bag", 1_000_000
    (tmp_path / "scene.yaml").write_text(BALLS)
    node = start_node(
        {
            "scene": tmp_path / "scene.yaml",
            "record": folder,
            "record_max_bytes": limit,
            "diagnostics_rate": 20.0,
        },
    )
    listener = client.listen(DiagnosticArray, "/diagnostics")
    # Text that hardly gets shorter: the first is kept as a whole, with the second it is too much.
    letters = string.ascii_letters + string.digits
    noise = "".join(random.Random(1).choices(letters, k=600_000))
    for name in ("one", "two"):
        path = tmp_path / f"{name}.yaml"
        path.write_text(f"version: 1\nsources: [{{name: {name}}}]\n# {noise}\n")
        answer = client.call("LoadScene", resource=str(path))
        assert answer.status.code == 0, answer.status

    def ended(message):
        return any(
            s.name.endswith("effect: record") and "record_max_bytes" in s.message
            for s in message.status
        )

    found = listener.wait_for(ended, "the end of the recording")
    assert int(diagnostics_values(found, "effect: record")["dropped"]) == 0
    client.forget(listener)
    assert 400_000 < size_of(folder) <= limit + 100_000  # the index comes on top
    with Reader(folder) as bag:
        assert bag.message_count > 0
    assert node.is_alive()
    code, said = replay(domain, folder, "--check")
    assert code == 0, said
    assert counted(said)[1] == 1, said
    assert node.stop() == 0


@pytest.fixture
def stuck(monkeypatch):
    """A disk that takes nothing until it is told to."""
    taking = threading.Event()
    write = spool.Bag.write

    def wait_and_write(bag, *message):
        assert taking.wait(60.0)
        write(bag, *message)

    monkeypatch.setattr(spool.Bag, "write", wait_and_write)
    monkeypatch.setattr(spool, "_MOST_WAITING", 10_000)
    yield taking
    taking.set()


def test_what_the_disk_is_too_slow_for_is_counted_and_said(stuck, tmp_path):
    """Who hands over never waits; the recording says where how many are missing."""
    tape = spool.Spool(tmp_path / "bag", "/events", 10**9)
    for _ in range(100):
        tape.put("/t", TEXT, encode("x", text="y" * 1000))
    dropped = tape.dropped
    assert 80 <= dropped < 100
    stuck.set()
    wait_until(lambda: tape.written == 100 - dropped, "what waited")
    tape.put("/t", TEXT, encode("after"))
    tape.close()
    events = [decode(m.data) for m in RecordingReader(tmp_path / "bag")]
    assert events[-2:] == [{"event": "lost", "count": dropped}, {"event": "after"}]
    assert len(events) == 100 - dropped + 2
    assert (tape.failure, tape.end) == ("", "")
