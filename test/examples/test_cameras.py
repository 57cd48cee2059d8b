"""Examples with cameras: what they show, and what they find in images of a real node."""

from pathlib import Path
import re
import subprocess
import sys

import numpy as np
from PIL import Image as Picture
import pytest
from sensor_msgs.msg import Image

from msg_adapters.arrays import uint8s_to_msg

ROOT = Path(__file__).parents[2]

# Green in front of red: a ball of 0.1 m around 1 m ahead, a probe of 0.05 m 0.4 m beside it.
SCENE = """
version: 1
sources: [{name: cell}]
geometries:
  - name: ball
    source: cell
    pose: {xyz: [0, 0, 1]}
    shape: {type: sphere, radius: 0.1}
    color: [0.35, 0.6, 0.3]
  - name: probe
    source: cell
    pose: {xyz: [0.4, 0, 0.9]}
    shape: {type: sphere, radius: 0.05}
    color: [0.9, 0.9, 0.9]
  - name: wall
    source: cell
    pose: {xyz: [0, 0, 3]}
    shape: {type: box, size: [9, 9, 1]}
    color: [0.85, 0.25, 0.2]
cameras:
  - {name: eye, source: cell, size: [65, 49], fov_y: 0.8, images: [color, depth]}
"""


def test_an_object_is_found_by_its_colour(surroundings, tmp_path):
    """The middle pixel sees the ball's nearest point, (0, 0, 0.9): 0.35 m from the probe."""
    (tmp_path / "scene.yaml").write_text(SCENE)
    arguments = ["--ros-args", "-p", f"scene:={tmp_path}/scene.yaml"]
    node = subprocess.Popen(
        [sys.executable, "-m", "scene_graph_ros.node", *arguments],
        cwd=ROOT,
        env=surroundings,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        script = [sys.executable, "examples/find_by_color.py"]
        result = subprocess.run(
            [*script, "--camera", "eye", "--near", "probe", "--rgb", "0.35", "0.6", "0.3"],
            cwd=ROOT,
            capture_output=True,
            text=True,
            timeout=150,
            env=surroundings,
            check=False,
        )
    finally:
        node.terminate()
        node.wait(60)
    assert result.returncode == 0, result.stdout + result.stderr
    assert "the nearest sees [0.0, 0.0, 0.9] m" in result.stdout
    name, off = re.search(r"It is on (\w+): ([\d.]+) micrometres", result.stdout).groups()
    assert name == "ball"
    assert float(off) < 0.1  # a float32 of 0.9 m is rounded by less
    (distance,) = re.findall(r"([\d.]+) mm from probe", result.stdout)
    assert float(distance) == pytest.approx(350.0, abs=1e-3)


@pytest.fixture
def camera_images(monkeypatch):
    """Import the module of the examples that gathers images."""
    monkeypatch.syspath_prepend(str(ROOT / "examples"))
    from common import camera_images

    return camera_images


class Reader:
    """A node whose subscriptions are called by hand."""

    def __init__(self):
        self.take = {}

    def create_subscription(self, kind, topic, callback, qos):
        """Remember whom to call."""
        self.take[topic.split("/")[-2]] = callback


def image(kind, second, label=0):
    """Return an image of 2 x 1 pixels."""
    encoding, pixels = {
        "color": ("rgb8", np.array([[[255, 0, 0], [0, 0, 255]]], np.uint8)),
        "depth": ("32FC1", np.array([[0.25, np.inf]], np.float32)),
        "label": ("16UC1", np.array([[label, 32766]], np.uint16)),
    }[kind]
    message = Image(
        height=1, width=2, encoding=encoding, data=uint8s_to_msg(pixels.view(np.uint8))
    )
    message.header.stamp.sec = second
    return message


def test_images_of_one_moment_are_put_together(camera_images, tmp_path):
    """Not those of two; the picture has the three beside each other."""
    reader = Reader()
    listener = camera_images.CameraListener(reader, "/cameras/eye")
    for kind, second in (("color", 1), ("depth", 1), ("label", 2), ("color", 2)):
        reader.take[kind](image(kind, second, label=4))
    assert (listener.frames, listener.best) == (0, None)
    reader.take["depth"](image("depth", 2))
    assert listener.frames == 1
    assert listener.best.num_labels() == 1
    np.testing.assert_array_equal(listener.best.depth, [[0.25, np.inf]])
    camera_images.draw_view(tmp_path / "view.png", listener.best)
    shown = np.asarray(Picture.open(tmp_path / "view.png"))[camera_images.CAPTION_HEIGHT]
    np.testing.assert_array_equal(shown[:2], [[255, 0, 0], [0, 0, 255]])
    near = int(255 * (1.0 - 0.25 / camera_images.FAR))
    np.testing.assert_array_equal(shown[2:4], [[near] * 3, [0] * 3])
    np.testing.assert_array_equal(shown[4], camera_images.LABEL_COLORS[4])
