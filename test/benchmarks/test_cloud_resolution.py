"""The benchmark of resolutions prints a row of each spacing and radius, and draws them."""

import re

import numpy as np

from benchmarks import cloud_resolution


def test_finer_clouds_have_fewer_false_collisions(capsys, monkeypatch, tmp_path):
    """Balls that cover miss no more than smaller ones; larger ones are false more often."""
    monkeypatch.setattr(cloud_resolution, "_CONFIGURATIONS", 500)
    monkeypatch.setattr(cloud_resolution, "_SPACINGS", (0.04, 0.16))
    assert cloud_resolution.main(["--picture", str(tmp_path / "c.png")]) == 0
    shown = capsys.readouterr().out
    found = re.findall(r"^\| (\d+) \| ([\d.]+) \| (\d+) \| ([\d.]+) \| ([\d.]+) \|", shown, re.M)
    rows = np.array(found, float)
    assert rows[:, 0].tolist() == 3 * [40.0] + 3 * [160.0]
    assert (rows[:3, 2] > rows[3:, 2]).all()
    false, missed = rows[:, 3].reshape(2, 3), rows[:, 4].reshape(2, 3)
    assert (np.diff(false, axis=1) >= 0.0).all()
    assert (np.diff(missed, axis=1) <= 0.0).all()
    assert (false[0] <= false[1]).all()
    assert false[1, 2] > 0.0
    assert (tmp_path / "c.png").stat().st_size > 1000
