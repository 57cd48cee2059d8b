"""What a recording takes of a topic, and when it asks for the whole scene."""

from __future__ import annotations

from types import SimpleNamespace

from std_msgs.msg import String

from scene_graph_ros.node.recording import recorder, spool
from scene_graph_ros.node.recording.events import decode, encode
from scene_graph_ros.replay.reader import RecordingReader


def test_the_whole_scene_is_asked_for_at_first_and_every_period(monkeypatch):
    """By a clock that the test moves."""
    now = [100.0]
    monkeypatch.setattr(recorder, "time", SimpleNamespace(monotonic=lambda: now[0]))
    tapes = SimpleNamespace(is_open=True)
    tape = recorder.Tape(tapes, String, "/t", None)
    assert tape.take_key()
    assert not tape.take_key()
    now[0] += recorder._KEY_PERIOD - 0.01
    assert not tape.take_key()
    now[0] += 0.02
    assert tape.take_key()
    now[0] += 2 * recorder._KEY_PERIOD
    tapes.is_open = False
    assert not tape.take_key()
    assert not tape.is_heard()


def test_events_are_strings_as_ros_writes_them():
    """Other programs read them as messages."""
    from rclpy.serialization import deserialize_message

    data = encode("update", limits=[1, 2, 3], text="ä")
    assert deserialize_message(data, String).data.startswith('{"event":"update"')
    assert decode(data) == {"event": "update", "limits": [1, 2, 3], "text": "ä"}


def test_more_contacts_than_a_sample_may_have_are_left_out_and_said(monkeypatch, tmp_path):
    """Of the topics of contacts alone: a scene with large meshes is needed as a whole."""
    node = SimpleNamespace(
        resolve_topic_name=lambda name: name.replace("~", "/n"),
        get_logger=lambda: SimpleNamespace(error=None),
    )
    recording = recorder.Recorder(node, str(tmp_path / "bag"), 10**9)
    monkeypatch.setattr(recorder, "_MOST_SAMPLE", 100)
    for name in ("~/contacts", "~/markers/proximity"):
        tape = recording.tape(String, name, name.replace("~", "/n"), recorder.QoSProfile(depth=1))
        for size in (100, 101):
            tape.write(bytes(size))
    recording.close()
    found = list(RecordingReader(tmp_path / "bag"))
    sizes = [(m.topic, len(m.data)) for m in found if m.topic != "/n/recording"]
    assert sizes == [("/n/contacts", 100)] + [("/n/markers/proximity", n) for n in (100, 101)]
    (event,) = (decode(m.data) for m in found if m.topic == "/n/recording")
    assert event == {"event": "left_out", "topic": "/n/contacts", "bytes": 101}


def test_a_clock_that_jumps_leaves_times_in_their_order(monkeypatch, tmp_path):
    """A recording's clock is the system's at its start, and steady from there."""
    steady, wall = [10**12], [10**18]
    clock = SimpleNamespace(monotonic_ns=lambda: steady[0], time_ns=lambda: wall[0])
    monkeypatch.setattr(spool, "time", clock)
    tape = spool.Spool(tmp_path / "bag", "/events", 10**9)
    for jump in (0, -(10**15), 10**17):
        steady[0] += 10**6
        wall[0] += jump
        tape.put("/t", "std_msgs/msg/String", encode("x"))
    tape.close()
    times = [message.time for message in RecordingReader(tmp_path / "bag")]
    assert times == [10**18 + k * 10**6 for k in (1, 2, 3)]
