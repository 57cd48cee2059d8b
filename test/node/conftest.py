"""Fixtures of the node's tests: isolated domains, the node as a process, a client."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys

import pytest

os.environ.setdefault("ROS_PYTHON_CHECK_FIELDS", "1")

HAS_ROS = importlib.util.find_spec("rclpy") is not None
collect_ignore_glob = [] if HAS_ROS else ["*test_*.py"]

if HAS_ROS:
    from domains import own_domain
    from node_harness import Client, kill_what_is_left, NodeProcess, outputs_of_nodes

    from scene_graph_ros.geometry.compiled.readiness import is_ready
    from scene_graph_ros.warmup.groups import GROUPS

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_makereport(item, call):
        """Show what the nodes have printed, where a test fails: a fault in them is told there."""
        report = yield
        if report.failed and (said := outputs_of_nodes()):
            report.sections.append(("output of nodes", said))
        return report

    @pytest.fixture(scope="session", autouse=True)
    def _all_kernels():
        """Kernels of all capabilities, without which an effect comes on a while after it is asked.

        `make test` has compiled them; after a change of the core others have not.
        """
        if not all(is_ready(group) for group in GROUPS):
            command = [sys.executable, "-m", "scene_graph_ros.warmup", "--all"]
            subprocess.run(command, check=True, stdout=subprocess.DEVNULL)

    @pytest.fixture(scope="module")
    def domain():
        """A ROS domain that nobody else on this machine uses meanwhile."""
        with own_domain() as number:
            yield number
            kill_what_is_left(number)

    @pytest.fixture(scope="module")
    def client(domain):
        """A client on the module's domain."""
        client = Client(domain)
        yield client
        client.close()

    @pytest.fixture(scope="module")
    def start_node(domain):
        """Start nodes on the module's domain; they are stopped at the end."""
        nodes = []

        def start(parameters=None, **options):
            node = NodeProcess(domain, parameters, **options)
            nodes.append(node)
            node.wait_for_output("running:")
            return node

        yield start
        for node in nodes:
            node.stop()
