"""The demo runs for real: three processes over DDS, and a picture of what they published."""

from pathlib import Path
import re
import signal
import subprocess
import sys

import numpy as np
from PIL import Image
import pytest
from transports import TRANSPORTS
from visualization_msgs.msg import Marker

ROOT = Path(__file__).parents[2]


def test_the_demo_sees_contacts_and_ends_by_itself(surroundings):
    """Three seconds of the demo end with exit code 0 and name contacts of the arm.

    It finds its transports itself, as where nobody has chosen any.
    """
    result = subprocess.run(
        [sys.executable, "examples/demo.py", "--seconds", "3", "--no-picture"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=150,
        env={name: value for name, value in surroundings.items() if name not in TRANSPORTS},
        check=False,
    )
    assert result.returncode == 0, result.stdout + result.stderr
    summary = result.stdout
    assert "3 sources" in summary
    assert " - " in summary.split("Contacts", 1)[1].split("Closest", 1)[0]
    assert "on: point_contact" in summary
    assert re.search(r"^In a browser, while this runs: file://\S+\.html$", summary, re.MULTILINE)


def _marker(kind: int, x: float, size: float) -> Marker:
    marker = Marker(type=kind, action=Marker.ADD)
    marker.pose.position.x = x
    marker.pose.orientation.w = 1.0
    marker.scale.x = marker.scale.y = marker.scale.z = size
    marker.color.r, marker.color.a = 1.0, 1.0
    return marker


@pytest.fixture
def picture(monkeypatch):
    """Import the drawing module of the examples."""
    monkeypatch.syspath_prepend(str(ROOT / "examples"))
    from common import picture

    return picture


def test_a_marker_is_drawn_where_it_is(picture):
    """A red cube fills the middle of the picture that looks at it, and not the corner."""
    camera = picture.Camera(eye=(0.0, -3.0, 0.0), target=(0.0, 0.0, 0.0), width=60, height=40)
    image = np.asarray(picture.trace([_marker(Marker.CUBE, 0.0, 0.5)], camera, samples=4), float)
    middle, corner = image[20, 30, :3], image[2, 2, :3]
    assert middle[0] > 2.0 * middle[1]
    assert abs(corner[0] - corner[1]) < 30.0


def test_the_camera_projects_to_the_right_and_up(picture):
    """A point right of and above the target lies right of and above the picture's middle."""
    camera = picture.Camera(eye=(0.0, -3.0, 0.0), target=(0.0, 0.0, 0.0), width=60, height=40)
    assert camera.project(np.zeros(3)) == pytest.approx((30.0, 20.0))
    x, y = camera.project(np.array([0.2, 0.0, 0.1]))
    assert x > 30.0
    assert y < 20.0


def test_projection_and_ray_tracer_agree(picture):
    """A small sphere off the axis shows up at the pixel that the projection names."""
    camera = picture.Camera(eye=(0.0, -3.0, 0.0), target=(0.0, 0.0, 0.0), width=60, height=40)
    image = picture.trace([_marker(Marker.SPHERE, 0.6, 0.2)], camera, samples=8)
    x, y = camera.project(np.array([0.6, 0.0, 0.0]))
    redness = np.asarray(Image.Image.convert(image, "RGB"), float)
    redness = redness[..., 0] - redness[..., 1]
    row, column = np.argwhere(redness > 0.5 * redness.max()).mean(axis=0)
    assert (column, row) == pytest.approx((x, y), abs=1.5)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize(
    ("command", "sign"),
    [
        (["panda_robot.py", "--rate", "500"], "publishing"),
        (["moving_objects.py"], "waiting for"),
    ],
)
def test_a_simulated_source_ends_cleanly_when_told_to(command, sign, number, surroundings):
    """While it publishes, and while it waits for the node, a signal ends it with exit code 0."""
    process = subprocess.Popen(
        [sys.executable, f"examples/{command[0]}", *command[1:]],
        cwd=ROOT,
        stderr=subprocess.PIPE,
        text=True,
        env={name: value for name, value in surroundings.items() if name not in TRANSPORTS},
    )
    try:
        line = process.stderr.readline()
        assert sign in line
        process.send_signal(number)
        _, rest = process.communicate(timeout=60)
    finally:
        process.kill()
    assert (process.returncode, "Traceback" in rest) == (0, False), rest


class Clocks:
    """A steady clock and the system's, which pass only while something sleeps or works."""

    def __init__(self, steady, system):
        self._steady, self._lead = steady, system - steady

    def monotonic(self):
        """Return the steady time."""
        return self._steady

    def time(self):
        """Return the system's time."""
        return self._steady + self._lead

    def sleep(self, seconds):
        """Let time pass."""
        self._steady += seconds


@pytest.fixture
def turns(monkeypatch):
    """Return the system's times of the first turns of ``repeat``, some of which take longer."""
    monkeypatch.syspath_prepend(str(ROOT / "examples"))
    from common import until_stopped

    def run(rate, phase, *works):
        clocks, times = Clocks(50.0, 1000.003), []
        monkeypatch.setattr(until_stopped, "time", clocks)

        def act():
            times.append(clocks.time())
            clocks.sleep(works[len(times) - 1])

        until_stopped.repeat(rate, act, lambda: len(times) == len(works), phase)
        return times

    return run


def test_turns_come_at_the_rate(turns):
    """They begin at once; how long they take does not matter as long as the next is not due."""
    assert turns(10.0, None, 0.0, 0.05, 0.0) == pytest.approx([1000.003, 1000.103, 1000.203])


def test_turns_begin_at_their_phase(turns):
    """It counts from multiples of the period of the system's time."""
    assert turns(10.0, 0.02, 0.0, 0.0) == pytest.approx([1000.02, 1000.12])


def test_turns_that_are_missed_are_left_out(turns):
    """The next one is in phase again."""
    assert turns(10.0, 0.02, 0.25, 0.0, 0.0) == pytest.approx([1000.02, 1000.32, 1000.42])
