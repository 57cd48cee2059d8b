"""A program that embeds the node ends as programs do, whatever it forgets at its end."""

from __future__ import annotations

import subprocess
import sys

from node_harness import environment, ROOT
import pytest

START = """
import threading
import rclpy
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from scene_graph_ros.node.node import SceneGraphNode

rclpy.init()
node = SceneGraphNode()
"""
SPIN = """
executor = {}()
executor.add_node(node)
executor.create_task(executor.wake)
executor.spin_once()
"""


@pytest.mark.parametrize(
    ("executor", "end"),
    [
        ("SingleThreadedExecutor", ""),
        ("SingleThreadedExecutor", "rclpy.shutdown()"),
        ("SingleThreadedExecutor", "rclpy.shutdown(); node.destroy_node()"),
        ("SingleThreadedExecutor", "node.server.deactivate()"),
        ("MultiThreadedExecutor", ""),
        ("MultiThreadedExecutor", "rclpy.shutdown()"),
    ],
)
def test_a_program_ends_with_0_whatever_it_does_at_its_end(domain, executor, end):
    """No abort, no traceback, and not for ever."""
    done = subprocess.run(
        [sys.executable, "-c", START + SPIN.format(executor) + end],
        env=environment(domain),
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "terminate" not in done.stderr
    assert "Traceback" not in done.stderr


def test_threads_end_with_their_context(domain):
    """After a shutdown nothing of the node waits any more, without `destroy_node`."""
    program = (
        f"{START}\n"
        "rclpy.shutdown()\n"
        "own = [t for t in threading.enumerate() if t is not threading.current_thread()]\n"
        "for thread in own: thread.join(60)\n"
        "assert len(own) == 5, own\n"
        "assert not any(thread.is_alive() for thread in own), own\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program],
        env=environment(domain),
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr
