"""The benchmark of images of depth prints a row of each camera and view."""

import re

from benchmarks import depth_images


def test_rows_have_points_and_times(monkeypatch, capsys):
    """Of both cameras, with small images; the robot is seen by the one that looks at it."""
    small = depth_images.CameraIntrinsics(64, 48, 60.0, 60.0, 31.5, 23.5)
    monkeypatch.setattr(depth_images, "_LENS", small)
    monkeypatch.setattr(depth_images, "_REPEATS", 1)
    assert depth_images.main() == 0
    rows = re.findall(
        r"^\| ([\w ]+) \| ([\w ]+) \| (\d+) \| (\d+) \|", capsys.readouterr().out, re.M
    )
    assert [row[1] for row in rows] == 2 * ["all", "blocks of 2 x 2", "a cloud"]
    assert {row[0] for row in rows} == {"looks at it", "at its wrist"}
    assert int(rows[2][2]) == int(rows[0][2])
    assert int(rows[0][2]) > int(rows[1][2]) > 10
    assert all(int(row[3]) > 100 for row in rows)
