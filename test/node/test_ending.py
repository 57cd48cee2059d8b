"""The process ends on SIGINT and SIGTERM, whatever its threads do and whenever they come."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path
import re
import signal
import subprocess
import sys
import time

from node_harness import DEADLINE, environment, NodeProcess, ROOT, wait_until
import pytest
from transports import BY_HAND

from scene_graph_ros.node.runtime.ending import delays, TIMEOUT

BOTH = pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
KILLED = 128

PATCHED = """
import sys, threading
import scene_graph_ros.node.{module} as patched

def stuck(self, *arguments):
    sys.stderr.write("stuck\\n")
    {how}

patched.{name} = stuck
from scene_graph_ros.node.main import main
main()
"""
FOR_EVER = "threading.Event().wait()"
WITH_THE_LOCK = "self.world.lock.acquire(); threading.Event().wait()"


HASTY = {"shutdown_timeout": TIMEOUT}


def patched(module, name, how):
    """Return a program that changes a function and then runs the node's command."""
    return PATCHED.format(module=module, name=name, how=how)


@BOTH
def test_a_thread_that_never_ends_does_not_keep_the_process(domain, number):
    """After the time the process ends by itself, with one line that names the thread."""
    node = NodeProcess(domain, HASTY, program=patched("server", "Server._update", WITH_THE_LOCK))
    node.wait_for_output("stuck")
    node.wait_for_output("running:")
    assert node.stop(number) == KILLED + number
    last = node.output().splitlines()[-1]
    assert f"{number.name} ends the process now, as {TIMEOUT} s are over" in last
    assert "world in" in last
    assert "stuck" not in last.partition(";")[0]
    assert "Traceback" not in node.output()


def test_time_without_a_processor_does_not_count(domain):
    """Where none is to be had for long, the end may take four times as long, and no longer."""
    starved = """
import scene_graph_ros.node.runtime.ending as patched
seen = [{"1": 0.0}]
patched.delays = lambda: seen.pop() if seen else {"1": 1e9}
"""
    program = starved + patched("server", "Server._update", FOR_EVER)
    node = NodeProcess(domain, {"shutdown_timeout": 0.3}, program=program)
    node.wait_for_output("stuck")
    begin = time.monotonic()
    assert node.stop(signal.SIGTERM) == KILLED + signal.SIGTERM
    assert time.monotonic() - begin >= 4 * 0.3
    assert "0.3 s are over" in node.output()


def test_how_long_threads_wait_for_a_processor(tmp_path):
    """The second number of /proc/<pid>/schedstat, in ns (proc(5)); a thread may be gone."""
    for name, text in (("7", "5000 2500000000 3\n"), ("8", "1 0 1\n"), ("9", "")):
        (tmp_path / name).mkdir()
        (tmp_path / name / "schedstat").write_text(text)
    (tmp_path / "10").mkdir()
    assert delays(tmp_path) == {"7": 2.5, "8": 0.0}
    assert delays(tmp_path / "none") == {}


def test_a_callback_of_the_executor_that_never_ends_does_not_keep_the_process(domain):
    """Nor does one that the main thread waits for because it spins."""
    node = NodeProcess(
        domain,
        {**HASTY, "executor": "single_threaded"},
        program=patched("diagnostics_topic", "DiagnosticsTopic._publish", FOR_EVER),
    )
    node.wait_for_output("stuck")
    assert node.stop(signal.SIGTERM) == KILLED + signal.SIGTERM
    assert "executor in node.runtime.guarded" in node.output()


def test_a_start_that_never_ends_does_not_keep_the_process(domain):
    """The main thread itself may be busy: the signal is obeyed all the same."""
    node = NodeProcess(domain, HASTY, program=patched("server", "Server.configure", FOR_EVER))
    node.wait_for_output("stuck")
    assert node.stop(signal.SIGINT) == KILLED + signal.SIGINT
    assert "MainThread in" in node.output()


def test_a_second_signal_ends_the_process_at_once(domain):
    """Long before the time that an end in order may take."""
    node = NodeProcess(
        domain, {"shutdown_timeout": 600.0}, program=patched("server", "Server._update", FOR_EVER)
    )
    node.wait_for_output("running:")
    node.wait_for_output("stuck")

    def ended():
        """Repeat the signal: what comes in one breath with the first counts as one with it."""
        node.process.send_signal(signal.SIGTERM)
        return node.process.poll() is not None

    wait_until(ended, "the end")
    assert node.process.returncode == KILLED + signal.SIGTERM
    assert "SIGTERM came as well" in node.output()


def test_an_end_in_order_leaves_no_shared_memory(domain):
    """What Fast DDS shares with other processes is given back; what others had is theirs."""
    shared = Path("/dev/shm")
    before = {str(path) for path in shared.glob("fastrtps_*")}
    node = NodeProcess(domain, extra_environment=BY_HAND, fresh=True)
    node.wait_for_output("running:")
    maps = Path(f"/proc/{node.process.pid}/maps").read_text()
    segments = set(re.findall(rf"{shared}/fastrtps_[0-9a-f]{{16}}", maps)) - before
    if not segments:
        pytest.skip("the middleware shares no memory")
    assert node.stop() == 0
    assert not [segment for segment in segments if Path(segment).exists()]


@BOTH
@pytest.mark.parametrize("module", ["numba", "rclpy"])
def test_a_signal_while_modules_are_imported_ends_the_process_with_code_0(domain, module, number):
    """No traceback, and nothing is said."""
    text = (
        "import sys, threading\n"
        "class Stuck:\n"
        "    def find_spec(self, name, path, target=None):\n"
        f"        if name == {module!r}:\n"
        "            sys.stderr.write('importing\\n')\n"
        "            threading.Event().wait()\n"
        "sys.meta_path.insert(0, Stuck())\n"
        "from scene_graph_ros.node.main import main\n"
        "main()\n"
    )
    with subprocess.Popen(
        [sys.executable, "-c", text],
        env=environment(domain),
        cwd=ROOT,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stderr.readline() == "importing\n"
        process.send_signal(number)
        assert process.wait(timeout=DEADLINE) == 0
        assert process.stderr.read() == ""


def fill(pipe):
    """Write to a pipe until the next one who writes has to wait."""
    os.set_blocking(pipe, False)
    with contextlib.suppress(BlockingIOError):
        while True:
            os.write(pipe, b" ")
    os.set_blocking(pipe, True)


def test_a_reader_that_is_stuck_does_not_keep_the_process(domain):
    """Where nobody takes what the process says, it ends without saying it."""
    text = patched("server", "Server._update", FOR_EVER)
    reader, writer = os.pipe()
    with subprocess.Popen(
        [sys.executable, "-c", text], env=environment(domain), cwd=ROOT, stderr=writer
    ) as process:
        said = b""
        while b"stuck" not in said:
            said += os.read(reader, 1000)
        fill(writer)
        process.send_signal(signal.SIGTERM)
        assert process.wait(timeout=DEADLINE) == KILLED + signal.SIGTERM
    os.close(reader)
    os.close(writer)


def test_a_callback_that_fails_does_not_end_the_process(domain):
    """What the executor raises is said in the log, with its traceback, and the node goes on."""
    how = "self.create_timer(0.05, lambda: 1 / 0); return arguments[1]"
    node = NodeProcess(domain, program=patched("runtime.guarded", "GuardedNode.survives", how))
    node.wait_for_output("running:")
    wait_until(lambda: node.output().count("ZeroDivisionError") > 1, "a second failure")
    assert "a callback failed; the node goes on" in node.output()
    assert node.stop() == 0
