"""Cameras as effects, without DDS: pace, faults of an engine, kernels that are missing."""

from __future__ import annotations

import sys
import threading
from types import SimpleNamespace

import pytest
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import Image
from spinning import wait_until

from scene_graph_ros.geometry import SceneGraph
from scene_graph_ros.geometry.perception import ExactRenderEngine
from scene_graph_ros.node.effects.frames import FrameThread, Pace
from scene_graph_ros.node.effects.manager import Effects
from scene_graph_ros.node.world.world import World
from scene_graph_ros.scene_files import load_scene_text

SCENE = """
version: 1
sources: [{name: cell}]
geometries:
  - {name: ball, source: cell, pose: {xyz: [0, 0, 1]}, shape: {type: sphere, radius: 0.5}}
cameras:
  - {name: good, source: cell, size: [4, 3], fov_y: 1, images: [depth], rate: 1000}
  - {name: bad, source: cell, size: [5, 3], fov_y: 1, images: [depth], rate: 1000}
"""


class Publisher:
    """A publisher that is always heard, and remembers what it published."""

    def __init__(self, kind, topic):
        self.kind, self.topic_name = kind, topic
        self.messages = []
        self.is_heard = True

    def get_subscription_count(self):
        """One reader."""
        return int(self.is_heard)

    def wait_for_all_acked(self, duration):
        """It has all."""
        return True

    def publish(self, data):
        """Remember a message."""
        is_read = isinstance(data, self.kind)
        self.messages.append(data if is_read else deserialize_message(data, self.kind))


class Host:
    """A node whose publishers remember what they published."""

    group = None
    world_frame = "world"
    recorder = channels = None
    troubles = ()

    def __init__(self, lack=lambda group: ""):
        self.publishers, self.errors = {}, []
        logger = SimpleNamespace(info=lambda text: None, error=self.errors.append)
        self.node = SimpleNamespace(
            create_publisher=self._create,
            destroy_publisher=lambda p: self.publishers.pop(p.topic_name),
            get_logger=lambda: logger,
            resolve_topic_name=lambda topic: topic,
        )
        self.effects = Effects(self, lack=lack)
        self.effects.open()

    def _create(self, kind, topic, *arguments, **options):
        publisher = self.publishers[topic] = Publisher(kind, topic)
        # Only images are heard, and transforms.
        publisher.is_heard = kind is Image or topic == "/tf"
        return publisher

    def parameter(self, name):
        """Return a value for each parameter that effects ask for."""
        return {"browser": False, "jog": ""}.get(name, 1.0)

    def publishers_changed(self):
        """Nothing follows them."""

    def request_update(self):
        """Nobody updates by itself."""

    def answer(self, name, snapshot):
        """Return what an effect found out."""
        return self.effects.answer(name, snapshot)

    def contacts_published(self, snapshot):
        """Nothing is timed."""

    def report(self, name):
        """Return what is told about an effect, None where there is none."""
        return next((r for r in self.effects.reports() if r.name == name), None)

    def images(self, camera):
        """Return the depth images of a camera so far."""
        return self.publishers[f"~/cameras/{camera}/depth/image"].messages


class BrokenEngine(ExactRenderEngine):
    """Fails for images of five columns, while it is broken."""

    is_broken = True

    def render(self, snapshot, core, *rest):
        """Fail, or render."""
        if BrokenEngine.is_broken and core.intrinsics.width == 5:
            raise RuntimeError("the lens is cracked")
        return ExactRenderEngine.render(self, snapshot, core, *rest)


def world_of(scene, engine=None):
    """Return a world with a scene in it, seen by an engine."""
    scene_graph = SceneGraph()
    if engine is not None:
        scene_graph.add_renderer("exact", engine)
    world = World(scene_graph)

    def load(edit):
        loaded = load_scene_text(scene).apply(edit.scene_graph)
        edit.add_cameras(loaded.cameras)

    world.edit(load)
    return world


def test_an_engine_that_fails_costs_its_own_camera_alone(monkeypatch):
    """It is off, with its reason, until the scene changes; another one goes on."""
    monkeypatch.setattr(BrokenEngine, "is_broken", True)
    world, host = world_of(SCENE, BrokenEngine()), Host()
    host.effects.update(world.snapshot)
    (error,) = wait_until(lambda: host.errors, "the fault")
    assert host.report("camera bad").failure == "RuntimeError: the lens is cracked"
    assert error.startswith("camera bad is off until the scene changes:\n")

    def good_goes_on():
        host.effects.update(world.snapshot)
        return len(host.images("good")) >= 3

    wait_until(good_goes_on, "images of the other camera")
    assert host.report("camera good").failure == ""
    assert host.images("bad") == []
    assert len(host.errors) == 1
    # It is mended with the next version of the scene.
    monkeypatch.setattr(BrokenEngine, "is_broken", False)
    world.edit(lambda edit: None)

    def bad_goes_on():
        host.effects.update(world.snapshot)
        return host.images("bad")

    wait_until(bad_goes_on, "images of the camera that failed")
    assert host.report("camera bad").failure == ""
    host.effects.close()
    assert host.publishers == {}


def test_a_render_server_that_is_gone_costs_its_own_camera_alone():
    """Nobody is at its port: that camera is off, with the address; another one goes on."""
    server = "renderers: [{name: far, type: gltf_client, base_url: 'http://127.0.0.1:1'}]\n"
    bad = "{name: bad, source: cell, size: [5, 3], fov_y: 1, images: [depth], rate: 1000"
    assert bad in SCENE
    world, host = world_of(SCENE.replace(bad, bad + ", renderer: far") + server), Host()
    host.effects.update(world.snapshot)
    wait_until(lambda: host.errors, "the fault")
    failure = host.report("camera bad").failure
    assert failure.startswith("EngineError: render server http://127.0.0.1:1/render: ")

    def good_goes_on():
        host.effects.update(world.snapshot)
        return len(host.images("good")) >= 3

    wait_until(good_goes_on, "images of the other camera")
    assert host.images("bad") == []
    host.effects.close()


def test_what_is_offered_while_a_frame_fails_is_not_tried(monkeypatch):
    """A camera is off until the scene changes, and that is told once."""
    is_rendering, may_fail = threading.Event(), threading.Event()

    class Halted(ExactRenderEngine):
        def render(self, *arguments):
            is_rendering.set()
            assert may_fail.wait(60.0)
            raise RuntimeError("the lens is cracked")

    scene = "\n".join(line for line in SCENE.splitlines() if "good" not in line)
    world, host = world_of(scene, Halted()), Host()
    host.effects.update(world.snapshot)
    assert is_rendering.wait(60.0)
    host.effects.update(world.snapshot)
    frames = host.effects.running("camera bad")._frames
    assert frames._newest is world.snapshot
    may_fail.set()
    wait_until(lambda: frames._newest is None, "the snapshot to be taken")
    frames.end()
    assert len(host.errors) == 1
    host.effects.close()


class Transforms:
    """Stands for tf2_msgs/TFMessage, which has one field."""

    def __init__(self, transforms):
        self.transforms = transforms


@pytest.mark.parametrize("is_installed", [True, False])
def test_transforms_of_optical_frames_go_out_where_their_messages_are(monkeypatch, is_installed):
    """With each image, from the world, where the camera is."""
    module = SimpleNamespace(TFMessage=Transforms) if is_installed else None
    monkeypatch.setitem(sys.modules, "tf2_msgs", SimpleNamespace())
    monkeypatch.setitem(sys.modules, "tf2_msgs.msg", module)
    placed = SCENE.replace("name: good, ", "name: good, pose: {xyz: [1, 2, -3]}, ")
    placed = placed.partition("  - {name: bad")[0]
    world, host = world_of(placed), Host()

    def has_image():
        host.effects.update(world.snapshot)
        return host.images("good")

    wait_until(has_image, "an image")
    if is_installed:
        wait_until(lambda: host.publishers["/tf"].messages, "a transform")
        (transform,) = host.publishers["/tf"].messages[0].transforms
        assert transform.header.frame_id == "world"
        assert transform.child_frame_id == "good_optical_frame"
        place = transform.transform.translation
        assert (place.x, place.y, place.z) == (1.0, 2.0, -3.0)
    else:
        assert "/tf" not in host.publishers
    host.effects.close()


def test_a_camera_waits_for_its_kernels():
    """Until they are compiled it is not on, has no topic, and says what it waits for."""
    lacks = {"cameras": "the kernels are being compiled: 1 of 9"}
    world, host = world_of(SCENE), Host(lambda group: lacks.get(group, ""))
    host.effects.update(world.snapshot)
    report = host.report("camera good")
    assert not report.is_on
    assert report.reason == (
        "not yet: the kernels are being compiled: 1 of 9; the scene has it on the world"
    )
    assert not any("cameras" in topic for topic in host.publishers)
    lacks.clear()
    host.effects.come_on(world.snapshot)
    host.effects.update(world.snapshot)
    assert host.report("camera good").is_on
    assert "~/cameras/good/depth/image" in host.publishers
    host.effects.close()


def test_a_scene_switches_its_cameras_off():
    """All by one name, which is no effect of its own."""
    world, host = world_of(SCENE), Host()
    host.effects.switch_off({"cameras"})
    host.effects.update(world.snapshot)
    report = host.report("camera good")
    assert (report.is_on, report.reason) == (False, "switched off by the scene file")
    assert not any("cameras" in topic for topic in host.publishers)


def test_a_camera_that_is_gone_leaves_nothing():
    """With its source it goes, and another of the same name has topics of its own."""
    world, host = world_of(SCENE), Host()
    host.effects.update(world.snapshot)
    before = host.publishers["~/cameras/good/depth/image"]
    world.edit(lambda edit: edit.cameras.pop("good"))
    host.effects.update(world.snapshot)
    assert host.report("camera good") is None
    assert "~/cameras/good/depth/image" not in host.publishers

    def again(edit):
        scene_graph = SceneGraph()
        loaded = load_scene_text(SCENE).apply(scene_graph)
        edit.cameras["good"] = loaded.cameras["good"]

    world.edit(again)
    host.effects.update(world.snapshot)
    assert host.publishers["~/cameras/good/depth/image"] is not before
    host.effects.close()


@pytest.mark.parametrize(
    ("takes", "missed"),
    [
        # (time of the frame, since when there was something to see)
        ([(0.0, 0.0), (0.5, 0.2), (1.0, 0.6)], [0, 0, 0]),
        # The second begins 0.7 s after it was due: one more should have begun by then.
        ([(0.0, 0.0), (1.2, 0.2), (1.5, 1.3)], [0, 1, 0]),
        ([(0.0, 0.0), (2.75, 0.2)], [0, 4]),
        # Nothing was there to be seen: nothing is late.
        ([(0.0, 0.0), (9.0, 9.0), (9.5, 9.1)], [0, 0, 0]),
    ],
)
def test_frames_that_are_late_are_counted(takes, missed):
    """At 2 Hz; a frame that is taken is always due."""
    pace = Pace(2.0)
    for (now, offered), expected in zip(takes, missed, strict=True):
        assert pace.wait(now) <= 0.0
        assert pace.take(now, offered) == expected
        assert 0.0 < pace.wait(now) <= 0.5


def test_the_newest_snapshot_wins():
    """What comes while a frame is made replaces what waits."""
    seen, go = [], threading.Semaphore(0)

    def make(snapshot):
        seen.append(snapshot)
        assert go.acquire(timeout=60.0)

    frames = FrameThread("test", 1000.0, make)
    frames.offer("first")
    wait_until(lambda: seen, "the first frame")
    for snapshot in ("second", "third", "fourth"):
        frames.offer(snapshot)
    go.release()
    wait_until(lambda: len(seen) == 2, "the second frame")
    go.release()
    frames.end()
    assert seen == ["first", "fourth"]
    frames.offer("fifth")
    assert seen == ["first", "fourth"]
