"""The benchmark of voxels prints its tables, and draws what their size costs."""

import re

import numpy as np

from benchmarks import voxels


def test_finer_voxels_have_fewer_false_collisions(capsys, monkeypatch, tmp_path):
    """None misses any; a grid of the boxes holds them, and an image and maps are read."""
    monkeypatch.setattr(voxels, "_CONFIGURATIONS", 300)
    monkeypatch.setattr(voxels, "_MOST_EDGES", 5)
    monkeypatch.setattr(voxels, "_OF_COAL", 3)
    monkeypatch.setattr(voxels, "_REPEATS", 1)
    monkeypatch.setattr(voxels, "_EDGES", (0.04, 0.16))
    monkeypatch.setattr(voxels, "_ROOM", 20)
    monkeypatch.setattr(voxels, "_IMAGE", (48, 64))
    monkeypatch.setattr(voxels, "_GRIDS", ((20, 0.15),))
    assert voxels.main(["--picture", str(tmp_path / "v.png")]) == 0
    shown = capsys.readouterr().out
    number = r" ([\d.]+|nan) \|"
    rows = np.array(re.findall(r"^\|" + 10 * number, shown, re.M), float)
    assert rows[:, 0].tolist() == [40.0, 160.0]
    assert rows[0, 1] > rows[1, 1] > 0.0
    assert rows[0, 4] <= rows[1, 4]
    assert rows[1, 4] > 0.0
    assert (rows[:, 5] == 0.0).all()
    (image,) = re.findall(r"^\| 20³ \| 150 \| (\d+) \| (\d+) \|", shown, re.M)
    assert all(int(each) > 0 for each in image)
    assert len(re.findall(r"octree \| \d+ \| [\d.]+ \|", shown)) == 2
    assert (tmp_path / "v.png").stat().st_size > 1000


def test_voxels_that_meet_a_box_hold_all_of_it():
    """Corners of the boxes are in occupied voxels, also at their faces."""
    states, lower = voxels.occupancy_of_boxes(0.07)
    rng = np.random.default_rng(0)
    for center, size in voxels.clouds.BOXES:
        p = center + rng.uniform(-0.5, 0.5, (500, 3)).round(1) * size
        at = np.floor((p - lower) / 0.07).astype(int)
        assert (states[tuple(at.T)] == 1).all()
    assert 0.0 < states.mean() < 0.5
