"""Kernels are compiled by one process at a time."""

import os
from pathlib import Path
import signal
import subprocess
import sys

import numba.core.config
import pytest

from scene_graph_ros.geometry.compiled import claims

_HOLD = """
import sys
from pathlib import Path
from scene_graph_ros.geometry.compiled.claims import claim

handle = claim(Path(sys.argv[1]), b"kernel")
print(handle is not None, flush=True)
sys.stdin.read()
"""

_COMPILE = """
import sys
from scene_graph_ros.geometry.compiled.cache import written_behind
from scene_graph_ros.geometry.compiled.kernel import compilation_count, kernel

def layer(below):
    @kernel
    def above(x):
        return below(x) + below(2.0 * x)
    return above

@kernel
def lowest(x):
    return x * x

kernels = [lowest]
for _ in range(3):
    kernels.append(layer(kernels[-1]))
with written_behind():
    for each in kernels if sys.argv[1] == "up" else kernels[::-1]:
        each(1.0)
print(compilation_count())
"""


def _holder(file):
    command = [sys.executable, "-c", _HOLD, str(file)]
    holder = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert holder.stdout.readline() == "True\n"
    return holder


def test_a_claim_waits_for_the_one_before_it_to_end(tmp_path, monkeypatch):
    """Of the same name; others are had at once, and one that is stopped is not waited for."""
    file = tmp_path / "claims"
    with _holder(file) as holder:
        other = claims.claim(file, b"another kernel")
        assert other is not None
        claims.give_up(other)
        holder.send_signal(signal.SIGSTOP)
        monkeypatch.setattr(claims, "PATIENCE", 0.05)
        assert claims.claim(file, b"kernel") is None
        monkeypatch.undo()
        holder.kill()
        handle = claims.claim(file, b"kernel")
        assert handle is not None
        claims.give_up(handle)


def test_a_forked_child_has_none_of_its_parents_claims(tmp_path, monkeypatch):
    """It lives on when its parent gives one up, which others then have at once."""
    monkeypatch.setattr(claims, "PATIENCE", 0.0)
    file = tmp_path / "claims"
    handle = claims.claim(file, b"kernel")
    reading, writing = os.pipe()
    child_reading, child_writing = os.pipe()
    child = os.fork()
    if child == 0:
        os.write(child_writing, b".")
        os.read(reading, 1)
        os._exit(0)
    assert os.read(child_reading, 1) == b"."
    assert claims.claim(file, b"kernel") is None
    claims.give_up(handle)
    again = claims.claim(file, b"kernel")
    os.write(writing, b".")
    assert os.waitpid(child, 0)[1] == 0
    assert again is not None
    for each in (reading, writing, child_reading, child_writing):
        os.close(each)
    claims.give_up(again)


def test_a_claim_where_no_file_can_be_is_an_error(tmp_path):
    """The cache says what is wrong with its folder."""
    with pytest.raises(OSError, match="claims"):
        claims.claim(tmp_path / "nowhere" / "claims", b"kernel")


def test_systems_without_such_locks_do_without(tmp_path, monkeypatch):
    """Two processes may compile the same kernel there."""
    monkeypatch.setattr(claims, "_LOCK", None)
    assert claims.claim(tmp_path / "claims", b"kernel") is None


@pytest.mark.skipif(bool(numba.core.config.DISABLE_JIT), reason="nothing is compiled")
def test_processes_side_by_side_compile_nothing_twice(tmp_path):
    """Four layers of kernels, for Python and for those above, from both ends."""
    environment = {
        **os.environ,
        "SCENE_GRAPH_ROS_KERNEL_CACHE": str(tmp_path / "cache"),
        "SCENE_GRAPH_ROS_COMPILE_PROGRESS": "off",
        "PYTHONPATH": str(Path(__file__).parents[3]),
    }

    script = tmp_path / "layers.py"
    script.write_text(_COMPILE)

    def start(way):
        command = [sys.executable, "-W", "ignore", str(script), way]
        return subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True)

    both = [start("up"), start("down")]
    counts = [int(each.communicate()[0]) for each in both]
    assert [each.returncode for each in both] == [0, 0]
    # The first layer's may be called from Python, and is called by the second layer's, and so on.
    assert 4 <= sum(counts) <= 4 + 3
