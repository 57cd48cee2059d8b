"""A program that embeds the node ends as programs do, whatever it forgets at its end."""

from __future__ import annotations

import json
import subprocess
import sys

from node_harness import Client, environment, ROOT, wait_until
import pytest
import rclpy

from scene_graph_ros.node.node import SceneGraphNode

ENDS = {
    "forgets": ("SingleThreadedExecutor", ""),
    "shuts down": ("SingleThreadedExecutor", "rclpy.shutdown()"),
    "destroys after": ("SingleThreadedExecutor", "rclpy.shutdown(); node.destroy_node()"),
    "deactivates": ("SingleThreadedExecutor", "node.server.deactivate()"),
    "threads, forgets": ("MultiThreadedExecutor", ""),
    "threads, shuts down": ("MultiThreadedExecutor", "rclpy.shutdown()"),
}
"""What programs do at their end, with which executor."""

PROGRAM = """
import json, os, sys, threading
import scene_graph_ros.geometry

# Each program is a child that has these imports behind it, and ends as any interpreter ends. It
# imports rclpy itself, whose tracing starts threads that the end of a process waits for.
codes = {}
for name, (executor, end) in json.loads(sys.argv[1]).items():
    child = os.fork()
    if child == 0:
        import rclpy, rclpy.executors
        from scene_graph_ros.node.node import SceneGraphNode

        rclpy.init()
        node = SceneGraphNode()
        executor = getattr(rclpy.executors, executor)()
        executor.add_node(node)
        executor.create_task(executor.wake)
        executor.spin_once()
        exec(end)
        break
    codes[name] = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
else:
    print(json.dumps(codes))
"""

THREADS = """
import threading
import rclpy
from scene_graph_ros.node.node import SceneGraphNode

rclpy.init()
node = SceneGraphNode()
own = [t for t in threading.enumerate() if t is not threading.current_thread()]
rclpy.shutdown()
for thread in own: thread.join(60)
assert len(own) == 5, own
assert not any(thread.is_alive() for thread in own), own
"""


def run(domain, *arguments):
    """Run a program to its end."""
    return subprocess.run(
        [sys.executable, "-c", *arguments],
        env=environment(domain),
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=200,
        check=False,
    )


@pytest.fixture(scope="module")
def programs(domain):
    """What became of all programs."""
    return run(domain, PROGRAM, json.dumps(ENDS))


@pytest.mark.parametrize("name", ENDS)
def test_a_program_ends_with_0_whatever_it_does_at_its_end(programs, name):
    """No abort, no traceback, and not for ever."""
    # The middleware may write lines of its own.
    assert json.loads(programs.stdout.splitlines()[-1])[name] == 0, programs.stderr
    assert "terminate" not in programs.stderr
    assert "Traceback" not in programs.stderr


def test_threads_end_with_their_context(domain):
    """After a shutdown nothing of the node waits any more, without `destroy_node`."""
    done = run(domain, THREADS)
    assert done.returncode == 0, done.stderr


def test_a_destroyed_node_leaves_nothing_in_the_graph(domain):
    """No service, no name, though the program still has the object."""
    client, context = Client(domain), rclpy.Context()
    rclpy.init(context=context, domain_id=domain)
    node = SceneGraphNode(context=context)

    def services():
        names = [name for name, _ in client.node.get_service_names_and_types()]
        return [name for name in names if name.startswith("/scene_graph/")]

    wait_until(
        lambda: {"/scene_graph/get_state", "/scene_graph/has_collisions"} <= set(services()),
        "the services of the node",
    )
    node.destroy_node()
    wait_until(lambda: not services(), "the end of its services")
    wait_until(lambda: "scene_graph" not in client.node.get_node_names(), "its end")
    rclpy.shutdown(context=context)
    client.close()
