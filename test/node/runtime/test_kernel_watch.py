"""What the node says and does where kernels have to be compiled."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path
import signal
import warnings

from node_harness import NodeProcess, wait_until
import pytest

from scene_graph_msgs.msg import ContactArray, Status
from scene_graph_ros.geometry.compiled.cache import KernelCacheWarning
from scene_graph_ros.geometry.compiled.kernel import kernel
from scene_graph_ros.geometry.compiled.readiness import ready_marker, why_not_ready
from scene_graph_ros.node.runtime import kernel_watch
from scene_graph_ros.node.runtime.kernel_watch import KernelWatch

pytestmark = pytest.mark.skipif(
    os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="there are no kernels"
)
CACHE = "SCENE_GRAPH_ROS_KERNEL_CACHE"
SCENE = """
version: 1
sources:
  - {name: bodies}
geometries:
  - {name: ball, source: bodies, shape: {type: sphere, radius: 0.1}}
  - {name: floor, source: bodies, shape: {type: half_space}}
"""


class Log:
    """Stands for a logger."""

    def __init__(self):
        self.warnings = []

    def warning(self, text):
        """Keep a text."""
        self.warnings.append(text)


def plus_one(x):
    """Add one."""
    return x + 1


def test_a_cache_that_can_not_be_written_is_named(monkeypatch, tmp_path):
    """Once, with the reason and the remedy, and not again when kernels are compiled."""
    file = tmp_path / "file"
    file.touch()
    monkeypatch.setenv(CACHE, str(file / "kernels"))
    log = Log()
    watch = KernelWatch(log)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", KernelCacheWarning)
        assert kernel(plus_one)(1) == 2
    watch.stop()
    (text,) = log.warnings
    assert str(file) in text
    assert "python -m scene_graph_ros.warmup" in text


def test_an_empty_cache_is_named_until_all_is_compiled(monkeypatch, tmp_path):
    """What was compiled is marked, group by group."""
    monkeypatch.setenv(CACHE, str(tmp_path / "kernels"))
    for group in ("main", "surfaces"):
        assert str(tmp_path / "kernels") in why_not_ready(group)
        ready_marker(group).touch()
        assert why_not_ready(group) == ""


def test_kernels_that_go_while_the_node_runs_are_named(monkeypatch, tmp_path):
    """At the first that has to be compiled; after the end of the watch nobody is told."""
    monkeypatch.setenv(CACHE, str(tmp_path))
    monkeypatch.setattr(kernel_watch, "why_not_ready", lambda group: "")
    log = Log()
    watch = KernelWatch(log)
    assert not log.warnings
    assert kernel(plus_one)(1) == 2
    (text,) = log.warnings
    assert "kernel plus_one has to be compiled" in text
    assert kernel(plus_one)(1.5) == 2.5
    assert len(log.warnings) == 1
    watch.stop()
    watch.stop()


def seconds_of_threads(pid):
    """Return the processor time (s) that each thread of a process has had."""
    found = {}
    for task in Path(f"/proc/{pid}/task").iterdir():
        # A thread may end meanwhile.
        with contextlib.suppress(FileNotFoundError, ProcessLookupError):
            found[task.name] = int((task / "schedstat").read_text().split()[0]) * 1e-9
    return found


@pytest.mark.slow
def test_a_node_that_compiles_answers_what_it_can_and_obeys_signals(client, domain, tmp_path):
    """Where a query has to wait for its kernels others do not, and nor does the end."""
    scene, file = tmp_path / "scene.yaml", tmp_path / "file"
    scene.write_text(SCENE)
    file.touch()
    node = NodeProcess(
        domain,
        {"scene": scene, "shutdown_timeout": 1.5},
        extra_environment={CACHE: str(file / "kernels")},
        fresh=True,
    )
    wait_until(lambda: "running:" in node.output(), "the node, which compiles", timeout=200.0)
    assert node.output().count("can't be kept") == 1
    # Pairs are compiled for these. Points take ten seconds of a processor more, which no other
    # thread needs meanwhile; all that DescribeScene needs is there already.
    client.listen(ContactArray, "/scene_graph/contacts").wait_for_newest(
        lambda message: True, "contacts, once their kernels are compiled"
    )
    before = seconds_of_threads(node.process.pid)
    query = client.start("ComputeSignedDistanceToPoint", points=[0.0, 0.0, 1.0])
    answer = client.start("DescribeScene")
    # What compiles shares the interpreter, and the processor with all other tests.
    wait_until(answer.done, "a response of DescribeScene", timeout=150.0)
    assert answer.result().status.code == Status.OK

    def compiles():
        now = seconds_of_threads(node.process.pid)
        return any(seconds > before.get(thread, 0.0) + 1.0 for thread, seconds in now.items())

    wait_until(compiles, "a thread that compiles", timeout=150.0)
    assert not query.done()
    assert node.stop(signal.SIGTERM) == 128 + signal.SIGTERM
    last = node.output().splitlines()[-1]
    assert "SIGTERM ends the process now" in last
    assert "requests" in last
