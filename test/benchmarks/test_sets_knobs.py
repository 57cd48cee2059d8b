"""The benchmark of knobs: what is taken for an error is one, and each knob has a row."""

import csv

import numpy as np
import pytest

from benchmarks.sets_knobs import KNOBS, main

KNOB = {knob.question: knob for knob in KNOBS}


def test_each_knob_has_a_row_and_a_picture(tmp_path, capsys):
    """With its first setting."""
    main(["--settings", "1", "--out", str(tmp_path)])
    with (tmp_path / "sets_knobs.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["question"] for row in rows] == list(KNOB)
    for row in rows:
        assert 1e-3 < float(row["error"]) < 1.0
        assert float(row["seconds"]) > 0.0
    assert (tmp_path / "sets_knobs.png").stat().st_size > 10_000
    assert len(capsys.readouterr().out.splitlines()) == len(KNOB) + 2


def test_errors_are_those_of_the_answers():
    """A volume that is a tenth too large, and samples that leave out half of the box."""
    right = float(np.prod(2.0 * np.linspace(1.0, 0.1, 4)))
    assert KNOB["volume by sampling, 4D"].error([1.1 * right] * 3) == pytest.approx(0.1)
    points = KNOB["1000 samples, 7D"].ask(64, 0)
    assert KNOB["1000 samples, 7D"].error([points]) < 0.1
    half = np.where((points @ points[0] > 0.0)[:, None], points, -points)
    assert KNOB["1000 samples, 7D"].error([half]) > 0.1
