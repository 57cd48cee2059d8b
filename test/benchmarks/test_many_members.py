"""Sets of many members are asked, and their answers are those by construction."""

import csv

from benchmarks import many_members


def test_each_question_is_asked_of_each_set(tmp_path, capsys):
    """Few members, one seed; wrong answers would raise."""
    path = tmp_path / "many_members.csv"
    arguments = ["--seeds", "1", "--dimensions", "3", "--points", "30", "--members", "4"]
    many_members.main([*arguments, "--csv", str(path)])
    rows = list(csv.DictReader(path.open(newline="")))
    assert {row["set"] for row in rows} == set(many_members.BODIES)
    assert len(rows) == len(many_members.BODIES) * 11
    assert "sum of balls 4 3" in capsys.readouterr().out
