"""What is read of the files that others name."""

import contextlib
import os
from pathlib import Path
import threading

import pytest

from scene_graph_ros.geometry import files
from scene_graph_ros.geometry.files import find_file, read_limited


def reason(action, *arguments):
    """Return what the system, or the limit, says against an action."""
    try:
        action(*arguments)
    except OSError as error:
        return error.strerror
    pytest.fail("nothing was said against it")


def test_a_file_within_the_limit_is_read(tmp_path):
    """As many bytes as the limit are read, one more is refused with both numbers."""
    path = tmp_path / "file"
    path.write_bytes(b"12345")
    assert read_limited(path, 5) == b"12345"
    assert find_file(path).st_size == 5
    assert reason(read_limited, path, 4) == "has 5 bytes, the limit is 4"


def test_a_sparse_file_takes_no_memory(tmp_path):
    """A file of 40 GB that takes no room on the disk is refused by its size."""
    path = tmp_path / "sparse"
    with path.open("wb") as file:
        file.truncate(40 * 2**30)
    assert reason(read_limited, path, 2**28) == "has 42949672960 bytes, the limit is 268435456"


def test_what_is_no_file_is_not_opened(tmp_path):
    """Pipes, devices and folders are refused: none of them has an end, or blocks."""
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    for path in (pipe, "/dev/zero", "/dev/tty"):
        assert reason(read_limited, path, 10) == "is no regular file"
        assert reason(find_file, path) == "is no regular file"
    assert reason(find_file, tmp_path) == "is a folder"
    assert reason(find_file, tmp_path / "nothing") == "No such file or directory"


def test_names_that_no_file_has():
    """A name with a NUL, or one that is too long, is refused like a file that is not there."""
    assert reason(find_file, "a\0b") == "embedded null byte"
    assert reason(find_file, "a" * 5000) == "File name too long"


@pytest.mark.skipif(not Path("/proc/kmsg").exists(), reason="there is no /proc here")
def test_files_of_proc_are_as_long_as_they_say():
    """A file whose size is 0 is empty, though reading it would wait for ever for more."""
    assert read_limited("/proc/self/maps", 10) == b""
    if os.access("/proc/kmsg", os.R_OK):
        with contextlib.suppress(PermissionError):  # whatever its mode says
            assert read_limited("/proc/kmsg", 10) == b""


def test_a_file_that_does_not_answer_is_given_up(monkeypatch, tmp_path):
    """A mount that is gone blocks in the system; the caller gets an error in time."""
    is_over = threading.Event()
    monkeypatch.setattr(files, "MAX_SECONDS", 0.05)
    monkeypatch.setattr(files, "_status", lambda path: is_over.wait())
    assert reason(find_file, tmp_path) == "gives no answer within 0.05 s"
    is_over.set()
