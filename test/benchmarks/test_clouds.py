"""The benchmark of clouds prints a row of each size."""

import re

from benchmarks import clouds


def test_each_size_has_a_row(capsys, monkeypatch):
    """Of times that are positive, beside the same without a cloud."""
    monkeypatch.setattr(clouds, "_CONFIGURATIONS", 40)
    monkeypatch.setattr(clouds, "_EDGES", 8)
    monkeypatch.setattr(clouds, "_coal", lambda count: f"Coal: {count}")
    clouds.main(["--counts", "50", "500"])
    shown = capsys.readouterr().out
    rows = re.findall(r"^\| (\d+) \| ([\d.]+) \| ([\d.]+) \| ([\d.]+) \| ([\d.]+) \|", shown, re.M)
    assert [row[0] for row in rows] == ["50", "500"]
    assert all(float(each) > 0.0 for row in rows for each in row[3:])
    assert "| none |" in shown
    assert "Coal: 500" in shown
