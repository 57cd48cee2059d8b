"""The benchmark of trajectories through regions prints mazes with costs and bounds."""

import re

from benchmarks import gcs_trajectories


def test_mazes_are_solved_with_both_orders(capsys, monkeypatch):
    """A small one: the search costs no more than the rounded paths, and its gap is closed."""
    monkeypatch.setattr(gcs_trajectories, "_has_drake", lambda: False)
    gcs_trajectories.main(["--sizes", "3"])
    text = capsys.readouterr().out
    assert "pydrake is not installed" in text
    rows = re.findall(r"^ *3x3 .*$", text, re.M)
    assert len(rows) == 2
    for row, order in zip(rows, (1, 3), strict=True):
        numbers = row.split()
        assert int(numbers[1]) == order
        cost, bound = float(numbers[8]), float(numbers[10])
        searched, gap = float(numbers[-2]), float(numbers[-1])
        assert bound <= searched <= cost + 1e-6
        assert gap <= 1e-5


def test_defaults_are_measured_alone(capsys, monkeypatch):
    """Without Drake its columns are NaN, and the bound is no more than the cost."""
    monkeypatch.setattr(gcs_trajectories, "_has_drake", lambda: False)
    gcs_trajectories.main(["--sizes", "3", "--defaults"])
    rows = re.findall(r"^ *3x3 .*$", capsys.readouterr().out, re.M)
    assert [int(row.split()[1]) for row in rows] == [1, 3]
    for row in rows:
        _, _, seconds, peer, cost, other, bound, _ = row.split()
        assert float(seconds) > 0.0
        assert (peer, other) == ("nan", "nan")
        assert float(bound) <= float(cost) + 1e-6
