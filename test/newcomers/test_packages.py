"""Packages as an interpreter shows them: all names, and the node's class where one looks."""

import importlib
import subprocess
import sys

import pytest

LAZY = ("geometry", "geometry.optimization", "planning", "robots", "scene_files")


@pytest.mark.parametrize("name", LAZY)
def test_dir_lists_what_can_be_imported(name):
    """Also before it is; and each name that is listed is there."""
    code = f"import scene_graph_ros.{name} as p; print('\\n'.join(dir(p)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    listed = set(done.stdout.split())
    package = importlib.import_module(f"scene_graph_ros.{name}")
    names = {*package.__all__, *getattr(package, "_ON_DEMAND", ())}
    assert names <= listed
    for each in names:
        getattr(package, each)
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        package.nothing  # noqa: B018 - looking for it is the test


def test_the_node_is_imported_from_its_package():
    """By the name that the page on the node gives; the package itself imports no rclpy."""
    pytest.importorskip("rclpy", reason="no ROS here")
    code = (
        "import sys, scene_graph_ros.node as n; assert 'rclpy' not in sys.modules;"
        "from scene_graph_ros.node import SceneGraphNode; print(SceneGraphNode.__module__);"
        "assert 'SceneGraphNode' in dir(n)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "scene_graph_ros.node.node"
