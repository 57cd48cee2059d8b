"""The example that finds a way through regions: its length and its bound, and the picture."""

from __future__ import annotations

import math
from pathlib import Path
import re
import sys

from PIL import Image as Picture
import pytest

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "examples"))

from path_through_regions import main  # noqa: E402

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
def test_the_way_over_a_wall_is_found_and_drawn(tmp_path, capsys, is_drawn):
    """A ball of 0.1 m goes over a wall 0.2 m thick and 0.7 m high, as high as its middle may."""
    scene, picture = tmp_path / "a.yaml", tmp_path / "a.png"
    scene.write_text(SCENE)
    options = ["--scene", str(scene), "--output", str(picture), *START, "--width", "80"]
    options += ["--sample", "0.2", "0.1", "1.1"]
    assert main([*options, *([] if is_drawn else ["--no-picture"])]) == 0
    told = capsys.readouterr().out
    cost, bound = re.findall(r"search: ([\d.]+) m, no way is below ([\d.]+) m", told)[0]
    # The middle keeps 0.1 m from faces: over the edges of a box 0.4 m thick and 0.8 m high.
    truth = 2.0 * math.hypot(0.2, 0.6) + 0.4
    assert float(cost) == pytest.approx(truth, abs=2e-6)
    assert float(bound) == pytest.approx(truth, abs=2e-6)
    assert "3 steps, each in its region" in told
    assert picture.exists() == is_drawn
    if is_drawn:
        with Picture.open(picture) as image:
            assert image.size[0] == 80
            assert image.getextrema() != image.convert("L").convert("RGB").getextrema()


def test_no_way_is_said(tmp_path, capsys):
    """Without a region over the wall there is none."""
    scene = tmp_path / "a.yaml"
    scene.write_text(SCENE)
    options = ["--scene", str(scene), "--no-picture", *START]
    assert main([*options, "--sample", "-0.2", "0.3", "0.3"]) == 1
    assert "No way: no edges lead from" in capsys.readouterr().out
