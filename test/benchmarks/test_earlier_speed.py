"""Rows beside those of an earlier version: in turns, by the least time of each."""

from contextlib import nullcontext

import pytest

from benchmarks import earlier_speed


@pytest.fixture
def turns(monkeypatch, tmp_path):
    """Calls in their order. The first time of each version is of the turn that warms up."""
    earlier = tmp_path / "earlier"
    earlier.mkdir()
    monkeypatch.setattr(earlier_speed, "sources_of", lambda _: nullcontext(earlier))
    monkeypatch.setattr(earlier_speed.shutil, "copytree", lambda *_: None)
    times = {"now": iter([0.1, 3.0, 2.0]), "before": iter([0.1, 4.0, 5.0])}
    asked = []

    def measured(sources, arguments):
        which = "before" if sources == earlier else "now"
        asked.append((which, arguments))
        slow, fast = ("mixed", 10, "point"), ("robot", 51, "collides")
        ms = next(times[which])
        return {slow: ms, fast: 1.0 if which == "now" else 4.0}

    monkeypatch.setattr(earlier_speed, "_measured", measured)
    return asked


def test_versions_take_turns_and_the_least_counts(turns, monkeypatch, capsys):
    """The warm-up, however quick, does not; what became slowest comes first."""
    words = ["earlier_speed", "--before", "abc", "--turns", "2", "--sizes", "10"]
    monkeypatch.setattr("sys.argv", words)
    earlier_speed.main()
    assert [which for which, _ in turns] == ["before", "now", "now", "before", "before", "now"]
    assert [arguments for _, arguments in turns[2:]] == [["--sizes", "10"]] * 4
    rows = [line for line in capsys.readouterr().out.splitlines() if line.startswith("| ")][2:]
    assert rows == [
        "| mixed | 10 | point | 4 | 2 | 0.500 |",
        "| robot | 51 | collides | 4 | 1 | 0.250 |",
    ]
