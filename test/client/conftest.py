"""A node with a small arm, an object on a stand and a camera, and a world that talks to it."""

from __future__ import annotations

import importlib.util
import os

import pytest
from small_arm import ARM

os.environ.setdefault("ROS_PYTHON_CHECK_FIELDS", "1")
HAS_ROS = importlib.util.find_spec("rclpy") is not None
collect_ignore_glob = [] if HAS_ROS else ["*test_*.py"]

CELL = """version: 1
sources: [{name: cell}, {name: objects}]
robots: [{name: arm, urdf: arm.urdf}]
frames:
  - {name: ball, source: objects, pose: {xyz: [0, 0, 3]}}
geometries:
  - {name: wall, source: cell, pose: {xyz: [0, 2, 0]}, shape: {type: box, size: [2, 0.1, 1]}}
  - {name: ball, source: objects, frame: ball, color: [1, 0, 0],
     shape: {type: sphere, radius: 0.1}}
cameras:
  - {name: above, source: cell, pose: {xyz: [0, 0, 6], rpy: [3.141592653589793, 0, 0]},
     size: [40, 30], fov_y: 0.8}
"""

if HAS_ROS:
    from domains import own_domain
    from node_harness import environment, kill_what_is_left, NodeProcess

    from scene_graph_ros.client import World

    @pytest.fixture(scope="module")
    def cell(tmp_path_factory):
        """A node in a namespace, in a domain of its own: the variables with which it is found."""
        folder = tmp_path_factory.mktemp("cell")
        (folder / "arm.urdf").write_text(ARM)
        (folder / "cell.yaml").write_text(CELL)
        with own_domain() as domain, pytest.MonkeyPatch.context() as patch:
            remaps = ["__ns:=/lab", "__node:=geometry"]
            node = NodeProcess(domain, {"scene": folder / "cell.yaml"}, remaps=remaps)
            node.wait_for_output("running:")
            for name, value in environment(domain).items():
                patch.setenv(name, value)
            yield node
            node.stop()
            kill_what_is_left(domain)

    @pytest.fixture
    def world(cell):
        """The world of that node."""
        with World(name="geometry", namespace="/lab", timeout=60.0) as world:
            yield world.wait_until_ready()
