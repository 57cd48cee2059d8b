"""Surfaces that take long silence nobody: points go out without them, and they follow."""

from __future__ import annotations

import threading
from types import SimpleNamespace

import pytest
from rclpy.serialization import deserialize_message

from scene_graph_msgs.msg import ContactArray
from scene_graph_ros.node.effects.contact_surfaces import ContactSurfaces
from scene_graph_ros.node.effects.manager import Effects
from scene_graph_ros.node.world.handles import Handle
from scene_graph_ros.node.world.scene import SourceRecord
from scene_graph_ros.node.world.world import World
from scene_graph_ros.scene_files import load_scene_text

DEADLINE = 60.0
"""Seconds after which a test gives up: far more than anything takes on a busy machine."""

SCENE = """
version: 1
sources: [{name: s}]
frames:
  - {name: pad, source: s, pose: {xyz: [0, 0, 0.19]}}
  - {name: a, source: s, pose: {xyz: [5, 0, 1]}}
  - {name: b, source: s, pose: {xyz: [5.1, 0, 1]}}
geometries:
  - name: floor
    source: s
    shape: {type: half_space}
    roles: {proximity: {hydroelastic: {compliance_type: rigid}}}
  - name: pad
    source: s
    frame: pad
    shape: {type: box, size: [0.2, 0.3, 0.4]}
    roles:
      proximity: {hydroelastic: {compliance_type: compliant, hydroelastic_modulus: 1e5}}
  - {name: a, source: s, frame: a, shape: {type: sphere, radius: 0.1}}
  - {name: b, source: s, frame: b, shape: {type: sphere, radius: 0.1}}
"""


class Publisher:
    """A publisher that is always heard, and remembers what it published."""

    def __init__(self, kind, topic):
        self.kind, self.topic_name = kind, topic
        self.messages = []

    def get_subscription_count(self):
        """One reader."""
        return 1

    def wait_for_all_acked(self, duration):
        """It has all."""
        return True

    def publish(self, data):
        """Remember a message."""
        is_read = isinstance(data, self.kind)
        self.messages.append(data if is_read else deserialize_message(data, self.kind))


class Host:
    """A node whose publishers remember what they published; it waits for no surfaces at all."""

    group = None
    world_frame = "world"
    recorder = channels = None
    troubles = ()

    def __init__(self):
        self.publishers = {}
        self.is_asked = threading.Event()
        self.request_update = self.is_asked.set
        logger = SimpleNamespace(
            info=lambda text: None, warning=lambda text: None, error=pytest.fail
        )
        self.node = SimpleNamespace(
            create_publisher=self._create,
            destroy_publisher=lambda publisher: None,
            get_logger=lambda: logger,
            resolve_topic_name=lambda topic: topic,
        )
        self.effects = Effects(self)
        self.effects.open()

    def _create(self, kind, topic, *arguments, **options):
        publisher = self.publishers[topic] = Publisher(kind, topic)
        return publisher

    def parameter(self, name):
        """Return a value for each parameter that effects ask for."""
        values = {"min_update_rate": 1e9, "marker_rate": 1e9, "browser": False, "jog": ""}
        return values.get(name, 1.0)

    def publishers_changed(self):
        """Nothing follows them."""

    def answer(self, name, snapshot):
        """Return what an effect found out."""
        return self.effects.answer(name, snapshot)

    def newest_answer(self, name):
        """Return what may be late."""
        return self.effects.newest_answer(name)

    def contacts_published(self, snapshot):
        """Nothing is timed."""


@pytest.fixture
def may_be_found(monkeypatch):
    """Surfaces are not found before this is set."""
    event, find = threading.Event(), ContactSurfaces.__call__

    def slow(question, snapshot):
        assert event.wait(DEADLINE)
        return find(question, snapshot)

    monkeypatch.setattr(ContactSurfaces, "__call__", slow)
    yield event
    event.set()


def move(world, stamp):
    """Give all frames a new stamp where they are."""
    with world.lock:
        world.frames("s").stamps[:] = stamp
        return world.commit(["s"], None)


def test_points_go_out_without_surfaces_that_are_late(may_be_found):
    """At each update all pairs have points, of its own stamp; then the surface comes, once."""
    world = World()

    def load(edit):
        loaded = load_scene_text(SCENE).apply(edit.scene_graph)
        source = loaded.sources["s"]
        edit.records["s"] = SourceRecord(source.source_id, "s")
        edit.handles["s"] = Handle(1)
        edit.initial_poses.update(source.initial_poses)

    world.edit(load)
    host = Host()
    for stamp in (10, 20, 30):
        host.effects.update(move(world, stamp))
    contacts = host.publishers["~/contacts"].messages
    assert [message.header.stamp.nanosec for message in contacts] == [10, 20, 30]
    assert [(len(m.points), len(m.surfaces)) for m in contacts] == [(2, 0)] * 3
    triangles = host.publishers["~/contact_surface_markers"].messages
    assert triangles == []

    may_be_found.set()
    assert host.is_asked.wait(DEADLINE)
    host.is_asked.clear()
    # The surface of the first snapshot is shown under its stamp, then that of the newest is found.
    host.effects.update(world.snapshot)
    assert {m.header.stamp.nanosec for m in triangles[-1].markers} <= {10, 30}
    while not contacts[-1].surfaces:
        assert host.is_asked.wait(DEADLINE)
        host.is_asked.clear()
        host.effects.update(world.snapshot)
    assert isinstance(contacts[-1], ContactArray)
    assert contacts[-1].header.stamp.nanosec == 30
    assert (len(contacts[-1].points), len(contacts[-1].surfaces)) == (1, 1)
    assert contacts[-1].points[0].geometry_a.name in "ab"
