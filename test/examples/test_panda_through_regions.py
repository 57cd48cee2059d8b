"""The example that moves a Panda through regions: what is proven, and the picture."""

from __future__ import annotations

from pathlib import Path
import re
import sys

import numpy as np
from PIL import Image as Picture

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "examples"))

import panda_through_regions  # noqa: E402

from scene_graph_ros.planning import RobotCollisionType  # noqa: E402


def test_the_way_is_proven_timed_and_drawn(tmp_path, capsys, monkeypatch):
    """Between its pieces the robot is nowhere nearer than proven, by distances alone."""
    picture, drawn = tmp_path / "a.png", []

    def watched(output, path, ends, checker, proven, width):
        drawn.append((path, ends, checker, proven))
        draw(output, path, ends, checker, proven, width)

    draw = panda_through_regions.draw
    monkeypatch.setattr(panda_through_regions, "draw", watched)
    assert panda_through_regions.main(["--output", str(picture), "--width", "60"]) == 0
    told = capsys.readouterr().out
    found = re.search(r"takes ([\d.]+) s, and none is more than (\S+) s", told)
    fastest, gap = map(float, found.groups())
    at_rest = float(re.search(r"From rest to rest it takes ([\d.]+) s", told)[1])
    assert fastest < at_rest
    assert gap < 1e-6
    ((path, (ends, moments), checker, proven),) = drawn
    assert len(proven) == len(ends) - 1 == len(moments) - 1
    np.testing.assert_allclose(path.value(ends[0]), panda_through_regions.START, atol=1e-9)
    np.testing.assert_allclose(path.value(ends[-1]), panda_through_regions.GOAL, atol=1e-9)
    assert (np.diff(moments) > 0.0).all()
    assert proven.min() > 0.001
    checker.set_padding_all_robot_environment_pairs(0.0)
    for k in range(0, len(proven), 7):
        for s in (ends[k], 0.3 * ends[k] + 0.7 * ends[k + 1]):
            found = checker.calc_robot_clearance(path.value(s), 0.3)
            outside = [
                kind is RobotCollisionType.ENVIRONMENT_COLLISION for kind in found.collision_types
            ]
            distances = np.asarray(found.distances)[outside]
            assert distances.min(initial=0.3) >= min(proven[k], 0.3) - 1e-9
    with Picture.open(picture) as image:
        assert image.size == (120, 51)
        assert len(image.convert("RGB").getcolors(1 << 20)) > 100
