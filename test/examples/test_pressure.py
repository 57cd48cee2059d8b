"""The gripper feels what the node publishes, and the pad's picture shows the pressure on it."""

from pathlib import Path
import re
import subprocess
import sys

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]


def test_the_gripper_squeezes_until_it_feels_the_forces(surroundings):
    """Two forces are reached; four times the force has about twice the radius squared: the area.

    Depth d of two bodies that are both linear gives an area of 2 pi R d and a force of R d^2.
    """
    result = subprocess.run(
        [sys.executable, "examples/pressure.py", "--forces", "2", "8", "--no-picture"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=200,
        env=surroundings,
        check=False,
    )
    assert result.returncode == 0, result.stdout + result.stderr
    found = re.findall(r"([\d.]+) N over ([\d.]+) square cm", result.stdout)
    (soft, small), (hard, large) = np.array(found, dtype=float)
    assert (soft, hard) == (pytest.approx(2.0, abs=0.1), pytest.approx(8.0, abs=0.2))
    assert large / small == pytest.approx(2.0, rel=0.1)


@pytest.fixture
def pressure_picture(monkeypatch):
    """Import the drawing module of the example."""
    monkeypatch.syspath_prepend(str(ROOT / "examples"))
    from common import pressure_picture

    return pressure_picture


def test_pressure_is_drawn_where_it_is(pressure_picture):
    """One triangle with 0, 10, 20 kPa at its corners: linear inside, nothing outside."""
    patch = object.__new__(pressure_picture.Patch)
    s = pressure_picture.HALF_WIDTH
    middle = np.array([0.0, 0.0, 0.048])
    patch.vertices_W = middle + s * np.array([[-1, 0, -1], [1, 0, -1], [-1, 0, 1]])
    patch.corners = np.array([[0, 1, 2]])
    patch.pressures = np.array([0.0, 10e3, 20e3])
    pressure, is_hit = pressure_picture._map(patch, 20)
    assert not is_hit[0, -1]  # up and right
    assert is_hit[-1, 0]  # down and left
    # The middle of the lowest left pixel is a fortieth of both edges away from the corner.
    assert pressure[-1, 0] == pytest.approx(10e3 / 40.0 + 20e3 / 40.0)
    assert pressure[0, 0] == pytest.approx(10e3 / 40.0 + 20e3 * 39.0 / 40.0)
