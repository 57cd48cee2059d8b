"""The benchmark of repairs: each kind of fault is made, repaired and measured."""

import pytest

from benchmarks.mesh_repairs import KINDS, measure, table_of


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
