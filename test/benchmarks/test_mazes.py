"""The benchmark of large mazes asks both ways and tells what it took."""

import sys

import pytest

from benchmarks import mazes_gcsopt
from benchmarks.mazes import main, measure


def test_a_small_maze_has_all_its_numbers():
    """Of nine cells: at most two edges a door, a gap that is closed."""
    row = measure(3)
    assert row.cells == 9
    assert row.kept <= row.edges <= 2 * 12 + 2
    assert 0.0 <= row.gap <= 1e-6
    assert row.rounded_gap >= row.gap - 1e-9


def test_all_doors_open_leave_the_straight_way():
    """Two edges a door and one at each end; the gap is closed."""
    row = measure(4, more=1.0)
    assert row.edges == 2 * 24 + 2
    assert row.gap <= 1e-6


def test_the_command_prints_a_line_for_each_maze(capsys):
    """And the machine."""
    main(["3", "4", "--more-doors", "0.5"])
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines[1:3]] == ["9", "16"]
    assert lines[-1].startswith("Measured on ")
    with pytest.raises(SystemExit):
        main([])


def test_beside_gcsopt_only_ours_is_measured_without_it(capsys, monkeypatch):
    """The bound is below the best path's cost; the remedy is named."""
    monkeypatch.setitem(sys.modules, "gcsopt", None)
    mazes_gcsopt.main(["3"])
    first, _, row, _ = capsys.readouterr().out.splitlines()
    assert "pip install gcsopt" in first
    size, ours, theirs, _, bound, _, exact, cost = row.split()
    assert (size, theirs) == ("3", "nan")
    assert float(ours) > 0.0 < float(exact)
    assert 4.0 * 0.6 < float(bound) <= float(cost)
