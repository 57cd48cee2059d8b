"""The benchmark of trajectories prints times and how far from the fastest they are."""

import re

from benchmarks import trajectories


def test_straight_ways_and_corners_are_compared(capsys, monkeypatch):
    """Nothing is faster than it can be, and more stretches are nearer to it."""
    monkeypatch.setattr(trajectories, "_REPEATS", 1)
    monkeypatch.setattr(trajectories, "_GRIDS", (2, 16))
    monkeypatch.setattr(trajectories, "_BEST", 64)
    monkeypatch.setattr(trajectories, "find_spec", lambda name: None)
    trajectories.main()
    text = capsys.readouterr().out
    rows = re.findall(r"^(\S+) +(\S+) +(\S+)\s*$", text, re.M)
    longer = [float(excess) for _, _, excess in rows if re.match(r"[\d.e+-]+$", excess)]
    assert len(longer) >= 5
    assert all(0.0 <= excess < 1e-3 for excess in longer[:5])
    corners = dict(re.findall(r"^(2|16) +\S+ +(\S+) +\S+$", text, re.M))
    assert float(corners["2"]) > float(corners["16"]) > 0.0
    assert len(re.findall(r"^proven, rise time", text, re.M)) == 2
