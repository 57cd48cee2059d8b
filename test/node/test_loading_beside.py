"""The first LoadScene imports what reads scenes, and the node goes on meanwhile."""

from __future__ import annotations

from node_harness import RUN_NODE, wait_until
import pytest
from scene_requests import RADIUS, register_balls, transform
from sensor_msgs.msg import MultiDOFJointState

from scene_graph_msgs.msg import ContactArray

CUBE = """
version: 1
sources: [{name: cell}]
geometries: [{name: cube, source: cell, shape: {type: box, size: [1, 1, 1]}}]
"""

HELD_IMPORT = """
import importlib.abc, importlib.machinery, pathlib, sys, time

def wait():
    pathlib.Path({folder!r}, "begun").touch()
    while not pathlib.Path({folder!r}, "go").exists():
        time.sleep(0.001)

class Held(importlib.abc.MetaPathFinder):
    # A module is found, and then made once a file is there.
    def find_spec(self, name, path, target=None):
        if name != {name!r}:
            return None
        spec = importlib.machinery.PathFinder.find_spec(name, path, target)
        spec.loader.create_module = lambda spec: wait()
        return spec

sys.meta_path.insert(0, Held())
"""
MODULE = "scene_graph_ros.scene_files.schema_shapes"


@pytest.fixture(name="folder", scope="module")
def _folder(tmp_path_factory):
    """Where the node says that it imports, and is told to go on."""
    return tmp_path_factory.mktemp("held")


@pytest.fixture(name="node", scope="module")
def _node(start_node, folder):
    """A node that starts without a scene, so that nothing was imported that reads them."""
    program = HELD_IMPORT.format(name=MODULE, folder=str(folder)) + RUN_NODE
    return start_node(program=program, fresh=True)


def press(client, poses, contacts, depth):
    """Have one ball overlap the other by so much, in m, and wait for that contact."""

    def found():
        message = MultiDOFJointState(joint_names=["b"])
        message.header.stamp = client.now()
        message.transforms = [transform(2.0 * RADIUS - depth)]
        poses.publish(message)  # again, if it is lost
        points = [] if contacts.newest is None else contacts.newest.points
        return [abs(point.depth - depth) < 1e-9 for point in points] == [True]

    wait_until(found, f"the contact of {depth} m")


def test_contacts_and_answers_come_while_a_scene_reader_is_imported(client, node, folder):
    """The import of the schema is held in its midst: poses, contacts and questions are not."""
    register_balls(client)
    contacts = client.listen(ContactArray, "contacts")
    poses = client.publisher(MultiDOFJointState, "/balls/poses")
    wait_until(poses.get_subscription_count, "the node")
    loading = client.start("LoadScene", text=CUBE)
    wait_until((folder / "begun").exists, "the import")
    for k in range(1, 21):
        press(client, poses, contacts, 0.01 * k)
        assert client.call("ListEffects").status.code == 0
        assert not loading.done()
    (folder / "go").touch()
    wait_until(loading.done, "the scene")
    assert loading.result().status.code == 0
    assert [source.name for source in loading.result().sources] == ["cell"]
