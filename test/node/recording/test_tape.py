"""What a recording takes of a topic, and when it asks for the whole scene."""

from __future__ import annotations

from types import SimpleNamespace

from std_msgs.msg import String

from scene_graph_ros.node.recording import recorder
from scene_graph_ros.node.recording.events import decode, encode


def test_the_whole_scene_is_asked_for_at_first_and_every_period(monkeypatch):
    """By a clock that the test moves."""
    now = [100.0]
    monkeypatch.setattr(recorder, "time", SimpleNamespace(monotonic=lambda: now[0]))
    spool = SimpleNamespace(is_open=True)
    tape = recorder.Tape(spool, String, "/t", None)
    assert tape.take_key()
    assert not tape.take_key()
    now[0] += recorder._KEY_PERIOD - 0.01
    assert not tape.take_key()
    now[0] += 0.02
    assert tape.take_key()
    now[0] += 2 * recorder._KEY_PERIOD
    spool.is_open = False
    assert not tape.take_key()
    assert not tape.is_heard()


def test_events_are_strings_as_ros_writes_them():
    """Other programs read them as messages."""
    from rclpy.serialization import deserialize_message

    data = encode("update", limits=[1, 2, 3], text="ä")
    assert deserialize_message(data, String).data.startswith('{"event":"update"')
    assert decode(data) == {"event": "update", "limits": [1, 2, 3], "text": "ä"}
