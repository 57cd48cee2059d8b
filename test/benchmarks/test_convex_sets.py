"""The benchmark of convex sets asks every question, and takes answers apart from times."""

import numpy as np

from benchmarks.convex_sets import main, measure


def test_every_question_has_a_time():
    """Of a polygon; alone or beside Drake, whose answers are the same."""
    rows = list(measure([(2, 8)], seconds=0.0, obstacles=(10,), mazes=(4,), many={2: 30}))
    assert len({row.what for row in rows}) == len(rows) == 24
    for row in rows:
        assert row.ours > 0.0
        assert row.agree == ("alone" if np.isnan(row.theirs) else "yes")


def test_the_command_prints_a_table(capsys):
    """A line for each row, and the machine."""
    main(["--most", "2", "--seconds", "0", "--most-obstacles", "10", "--most-cells", "0"])
    lines = capsys.readouterr().out.splitlines()
    assert sum("2/24" in line for line in lines) == 19
    assert lines[-1].startswith("Measured on ")
