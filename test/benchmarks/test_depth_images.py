"""The benchmark of images of depth prints a row of each camera and step."""

import re

from benchmarks import depth_images


def test_rows_have_points_and_times(monkeypatch, capsys):
    """Of both cameras, with small images; the robot is seen by the one that looks at it."""
    small = depth_images.CameraIntrinsics(64, 48, 60.0, 60.0, 31.5, 23.5)
    monkeypatch.setattr(depth_images, "_LENS", small)
    monkeypatch.setattr(depth_images, "_REPEATS", 1)
    assert depth_images.main() == 0
    rows = re.findall(r"^\| ([\w ]+) \| (\d) \| (\d+) \| (\d+) \|", capsys.readouterr().out, re.M)
    assert [row[:2] for row in rows] == [
        ("looks at it", "1"), ("looks at it", "2"), ("at its wrist", "1"), ("at its wrist", "2")
    ]  # fmt: skip
    assert int(rows[0][2]) > int(rows[1][2]) > 10
    assert all(int(row[3]) > 100 for row in rows)
