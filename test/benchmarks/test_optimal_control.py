"""The benchmark of optimal control prints its rows, and draws what accuracy costs."""

import re

import matplotlib.image

from benchmarks import optimal_control


def test_ours_is_measured_without_drake(capsys, monkeypatch):
    """Swing-ups are solved, and times are positive."""
    monkeypatch.setattr(optimal_control, "_has_drake", lambda: False)
    assert optimal_control.main(["--runs", "1"]) == 0
    text = capsys.readouterr().out
    assert "pydrake is not installed" in text
    assert len(re.findall(r"^swing-up.* ours solved, starts: \d", text, re.MULTILINE)) == 6
    for line in text.splitlines()[4:]:
        assert float(re.search(r" (\d+\.\d{5}) ", line).group(1)) > 0.0


def test_error_falls_with_knots(capsys, tmp_path):
    """Sixteen knots of collocation are as exact as hundreds of transcription's."""
    picture = tmp_path / "accuracy.png"
    options = ["--accuracy", "--most-knots", "32", "--output", str(picture)]
    assert optimal_control.main(options) == 0
    rows = re.findall(r"^(\w+) +(\d+) +[\d.]+ +(\S+)", capsys.readouterr().out, re.MULTILINE)
    errors = {(name, int(knots)): float(error) for name, knots, error in rows if name != "method"}
    assert errors["collocation", 32] < 1e-2 * errors["collocation", 8]
    assert errors["transcription", 32] > 1e3 * errors["collocation", 32]
    assert matplotlib.image.imread(picture)[..., :3].std() > 0.05
