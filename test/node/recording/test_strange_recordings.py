"""Recordings of strangers: one sentence and exit code 2, whatever they hold; none of it is run."""

import json
from pathlib import Path
import struct
import sys
import time

import pytest

from msg_adapters.message_classes import class_of_kind, UnknownKindError
from scene_graph_ros.node.recording import bag, spool
from scene_graph_ros.node.recording.events import encode, VERSION
from scene_graph_ros.replay import reader
from scene_graph_ros.replay.__main__ import main
from scene_graph_ros.replay.reader import RecordingReader, zstd

_MAGIC = b"\x89MCAP0\r\n"
_QOS = """\
- history: 1
  depth: {depth}
  reliability: 1
  durability: 2
  deadline: {{sec: 9223372036, nsec: 854775807}}
  lifespan: {{sec: 9223372036, nsec: 854775807}}
  liveliness: 1
  liveliness_lease_duration: {{sec: 9223372036, nsec: 854775807}}
  avoid_ros_namespace_conventions: false
"""


def _text(text: str) -> bytes:
    return struct.pack("<I", len(text.encode())) + text.encode()


def _record(code: int, content: bytes) -> bytes:
    return struct.pack("<BQ", code, len(content)) + content


def _header(topic="/t", kind="std_msgs/msg/String", qos=None) -> bytes:
    offered = _text("offered_qos_profiles") + _text(_QOS.format(depth=1) if qos is None else qos)
    schema = struct.pack("<H", 1) + _text(kind) + _text("ros2msg") + _text("string data")
    channel = struct.pack("<HH", 1, 1) + _text(topic) + _text("cdr")
    return _record(3, schema) + _record(4, channel + struct.pack("<I", len(offered)) + offered)


def _message(stamp: int, data: bytes = b"\0\1\0\0\1\0\0\0\0") -> bytes:
    return _record(5, struct.pack("<HIQQ", 1, 0, stamp, stamp) + data)


def _chunk(records: bytes) -> bytes:
    packed = zstd.compress(records)
    head = struct.pack("<QQQI", 0, 0, len(records), 0) + _text("zstd")
    return _record(6, head + struct.pack("<Q", len(packed)) + packed)


def _event(text: str) -> bytes:
    content = text.encode() + b"\0"
    return b"\0\1\0\0" + struct.pack("<I", len(content)) + content


def _write(folder: Path, records: bytes) -> Path:
    folder.mkdir()
    end = _record(15, struct.pack("<I", 0)) + _MAGIC
    (folder / "a.mcap").write_bytes(_MAGIC + records + end)
    return folder


_STRANGE = {
    "a kind without slashes": (_header(kind="String") + _message(1), "package/msg/Name"),
    "a kind that is not installed": (_header(kind="evilpkg/msg/X") + _message(1), "evilpkg"),
    "QoS that is no YAML": (_header(qos="{[") + _message(1), "offered QoS"),
    "QoS that is a number": (_header(qos="7") + _message(1), "offered QoS"),
    "an endless queue": (_header(qos=_QOS.format(depth=10**14)) + _message(1), "depth"),
    "a topic with blanks": (_header(topic="/a b") + _message(1), "'/a b'"),
    "292 years later": (_header() + _message(1) + _message(9 * 10**18), "its time is damaged"),
}


@pytest.mark.parametrize("case", _STRANGE)
def test_what_can_not_be_published_is_one_sentence(case, tmp_path, monkeypatch, capsys):
    """Nothing sleeps for it, and nothing of the working folder is imported."""
    records, reason = _STRANGE[case]
    package = tmp_path / "evilpkg"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "msg.py").write_text("raise SystemExit('imported')")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend("")
    begin = time.monotonic()
    assert main([str(_write(tmp_path / "bag", records)), "--quiet"]) == 2
    said = capsys.readouterr().err
    assert reason in said and len(said.splitlines()) == 1
    assert time.monotonic() - begin < 200.0
    assert "evilpkg" not in sys.modules


@pytest.mark.parametrize(
    "event",
    ["[" * 100_000, '{"event":' * 100_000, '{"event": "begin"}', '{"event": "__class__"}', "7"],
)
def test_events_that_are_none_are_one_sentence(event, tmp_path, capsys):
    """Also those that are nested too deeply for a parser."""
    header = _header(topic="/scene_graph/recording", qos="")
    folder = _write(tmp_path / "bag", header + _message(1, _event(event)))
    assert main([str(folder), "--check", "--quiet"]) == 2
    said = capsys.readouterr().err
    assert said.startswith("replay: ") and len(said.splitlines()) == 1


def test_a_chunk_is_unpacked_to_a_limit(tmp_path, monkeypatch, capsys):
    """A thousand times what it takes in the file."""
    monkeypatch.setattr(reader, "_MOST_BYTES", 1 << 20)
    folder = _write(tmp_path / "bag", _chunk(_header() + _message(1, bytes(1 << 22))))
    assert (folder / "a.mcap").stat().st_size < 10_000
    unpacked = []
    decompressor = zstd.ZstdDecompressor

    class Counting:
        def decompress(self, *arguments):
            unpacked.append(decompressor().decompress(*arguments))
            return unpacked[-1]

    monkeypatch.setattr(zstd, "ZstdDecompressor", Counting)
    assert main([str(folder), "--quiet"]) == 2
    assert "unpacks to more than 1048576 bytes" in capsys.readouterr().err
    assert [len(each) for each in unpacked] == [(1 << 20) + 1]


def test_what_is_within_the_limit_is_read(tmp_path):
    """The limit is of the unpacked records."""
    folder = _write(tmp_path / "bag", _chunk(_header() + _message(1, bytes(1000))))
    assert [len(each.data) for each in RecordingReader(folder)] == [1000]


def test_a_flipped_bit_never_ends_in_a_traceback(tmp_path, capsys):
    """In every byte of a small recording."""
    begin = encode("begin", version=VERSION, id=1, parameters={}, path="", text="", given=False)
    event = json.loads(begin[8:-1])
    header = _header(topic="/scene_graph/recording", qos="")
    folder = _write(tmp_path / "bag", header + _message(1, _event(json.dumps(event))))
    path = folder / "a.mcap"
    whole = path.read_bytes()
    for byte in range(0, len(whole), 3):
        changed = bytearray(whole)
        changed[byte] ^= 1 << byte % 8
        path.write_bytes(bytes(changed))
        assert main([str(folder), "--check", "--quiet"]) == 2
        assert "Traceback" not in capsys.readouterr().err


@pytest.mark.parametrize(
    ("kind", "reason"),
    [
        ("std_msgs/msg/Nope", "not in the installed std_msgs"),
        ("std_msgs/srv/String", "package/msg/Name"),
        ("../x/msg/Y", "package/msg/Name"),
        ("os/msg/path", "no package os is installed"),
    ],
)
def test_only_installed_kinds_are_imported(kind, reason):
    """The ament index says which packages there are."""
    with pytest.raises(UnknownKindError, match=reason):
        class_of_kind(kind)
    assert class_of_kind("std_msgs/msg/String").__name__ == "String"


def test_no_installed_package_is_taken_from_the_working_folder(tmp_path, monkeypatch):
    """A package of an installed one's name lies there."""
    (tmp_path / "installed_somewhere").mkdir()
    monkeypatch.setattr("msg_adapters.message_classes.get_package_prefix", lambda name: "/opt")
    (tmp_path / "installed_somewhere" / "__init__.py").write_text("")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend("")
    with pytest.raises(UnknownKindError, match="working folder"):
        class_of_kind("installed_somewhere/msg/X")


def _removed(folder: Path) -> None:
    for path in folder.iterdir():
        path.unlink()
    folder.rmdir()


def test_a_folder_that_is_removed_meanwhile_is_noticed_and_told(tmp_path, monkeypatch):
    """By the next time that messages are handed to the system."""
    monkeypatch.setattr(spool, "_FLUSH_PERIOD", 0.01)
    told = []
    tape = spool.Spool(tmp_path / "bag", "/events", 10**9, told.append)
    _removed(tmp_path / "bag")
    tape._thread.join(60.0)
    assert not tape.is_open
    assert tape.failure == told[0] and "was removed" in told[0]


def test_a_full_disk_is_told(tmp_path, monkeypatch):
    """In the thread that writes, when it fails."""

    def full(self):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(spool, "_FLUSH_PERIOD", 0.01)
    monkeypatch.setattr(bag.Bag, "flush", full)
    told = []
    tape = spool.Spool(tmp_path / "bag", "/events", 10**9, told.append)
    tape._thread.join(60.0)
    assert "No space left on device" in told[0]


def test_a_recording_beside_a_node_ends_with_code_4_where_its_folder_goes(
    tmp_path, monkeypatch, capsys
):
    """And says so on stderr."""
    from scene_graph_ros import record

    monkeypatch.setattr(record, "_record", lambda tape, *_: tape._thread.join(60.0))
    monkeypatch.setattr(spool, "_FLUSH_PERIOD", 0.01)
    monkeypatch.setattr(record.signal, "signal", lambda *_: None)
    monkeypatch.setattr(spool.Spool, "put", lambda self, *_: _removed(tmp_path / "bag"))
    assert record.main([str(tmp_path / "bag")]) == 4
    assert "was removed" in capsys.readouterr().err
