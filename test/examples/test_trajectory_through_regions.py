"""The example that finds a trajectory through regions: its time, its proof, and the picture."""

from __future__ import annotations

from pathlib import Path
import re
import sys

import numpy as np
from PIL import Image as Picture
import pytest

from scene_graph_ros.geometry.optimization import HPolyhedron
from scene_graph_ros.planning.trajectories import BezierCurve, CompositeTrajectory

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "examples"))

from trajectory_through_regions import keeps_clear, main  # noqa: E402

SCENE = """
version: 1
sources: [{name: cell}]
geometries:
  - name: wall
    source: cell
    pose: {xyz: [0.2, 0.0, 0.35]}
    shape: {type: box, size: [0.2, 3.0, 0.7]}
"""
START = ["--start", "-0.2", "0", "0.2", "--goal", "0.6", "0", "0.2", "--radius", "0.1"]


@pytest.mark.parametrize("is_drawn", [False, True])
def test_the_trajectory_over_a_wall_is_found_proven_and_drawn(tmp_path, capsys, is_drawn):
    """A ball of 0.1 m goes up 0.6 m and down again with 0.5 m/s at most: 2.4 s at least."""
    scene, picture = tmp_path / "a.yaml", tmp_path / "a.png"
    scene.write_text(SCENE)
    options = ["--scene", str(scene), "--output", str(picture), *START, "--width", "80"]
    options += ["--sample", "0.2", "0.1", "1.1"]
    assert main([*options, *([] if is_drawn else ["--no-picture"])]) == 0
    told = capsys.readouterr().out
    assert "3 of 3 times an obstacle is proven to be outside" in told
    assert "ball inside the 3 regions on its way at all times: proven" in told
    cost, bound = re.findall(r"searched: cost ([\d.]+), none is below ([\d.]+)", told)[0]
    seconds = float(re.findall(r"^([\d.]+) s, velocities", told, re.M)[0])
    assert 2.4 <= seconds <= float(cost)
    assert float(bound) == pytest.approx(float(cost), abs=1e-4)
    nearest = float(re.findall(r"least distance to the scene at \d+ times: ([\d.]+) m", told)[0])
    assert nearest >= 0.1
    # The same path is no shorter, and begins and ends at rest.
    at_rest = float(re.findall(r"within 2 m/s\^2, too: ([\d.]+) s", told)[0])
    assert at_rest > 2.4 + 0.5 / 2.0
    assert picture.exists() == is_drawn
    if is_drawn:
        with Picture.open(picture) as image:
            assert image.size[0] == 80
            assert image.getextrema() != image.convert("L").convert("RGB").getextrema()


def test_no_trajectory_is_said(tmp_path, capsys):
    """Without a region over the wall there is none."""
    scene = tmp_path / "a.yaml"
    scene.write_text(SCENE)
    options = ["--scene", str(scene), "--no-picture", *START]
    assert main([*options, "--sample", "-0.2", "0.3", "0.3"]) == 1
    assert "No trajectory: no edges lead from 'start[0]' to 'goal[0]'" in capsys.readouterr().out


def test_a_control_point_nearer_than_the_radius_is_not_clear():
    """By an ulp of its coordinate: what is shown is shown in fractions."""
    box = HPolyhedron.make_box([0.0, 0.0, 0.0], [1.0, 1.0, 1.0])
    points = np.array([[0.5, 0.5, 0.5], [0.75, 0.25, 0.5]])
    for y, expected in [(0.25, True), (np.nextafter(0.25, 0.0), False)]:
        points[1, 1] = y
        curve = CompositeTrajectory((BezierCurve(0.0, 1.0, points),))
        assert keeps_clear(curve, [box], 0.25) == expected
