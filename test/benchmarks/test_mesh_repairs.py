"""The benchmark of repairs: each kind of fault is made, repaired and measured."""

import pytest

from benchmarks.mesh_repairs import GAPS, KINDS, measure, Row, table_of, table_of_tolerances, write


def test_each_kind_is_measured_and_exact():
    """Errors are rounding, but for seams, whose numbers are off by that of 32 bits."""
    rows = [measure(kind, 400) for kind in KINDS]
    for row in rows:
        assert row.triangles > 50
        assert row.reading > 0.0
        assert row.error < (1e-7 if "seams" in row.kind else 1e-12), row
    lines = table_of(rows)
    assert len(lines) == 2 + len(KINDS)
    assert lines[2].split("|")[4].strip() == "1"
    with pytest.raises(KeyError):
        measure("no kind", 400)


def test_gaps_are_closed_by_tolerances_above_their_width():
    """What stays open has no inside, so its distances inside have the wrong sign."""
    rows = [measure(kind, 400, tolerance) for kind in GAPS for tolerance in (1e-8, 1e-4)]
    assert [row.is_closed for row in rows] == [False, True, False, True, True, True]
    assert [row.error < 1e-5 for row in rows] == [False, True, False, True, True, True]
    assert "| 1e-08 | no |" in table_of_tolerances(rows)[2]


def test_the_file_has_all_columns(tmp_path):
    """In seconds, a line for each mesh."""
    write([Row("seams", 12, 0.25, 1e-8, 2e-6, 1e-6, True)], tmp_path / "rows.csv")
    header, line = (tmp_path / "rows.csv").read_text().splitlines()
    assert header.split(",") == list(Row._fields)
    assert line == "seams,12,0.25,1e-08,2e-06,1e-06,True"
