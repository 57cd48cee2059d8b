"""The example of an edge that samples take for free: it says where the proof finds a collision."""

import math
from pathlib import Path
import re
import sys

from PIL import Image as Picture
import pytest

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "examples"))

from sampled_and_proven import ANGLE, main  # noqa: E402


def test_samples_see_nothing_and_the_proof_says_where_it_is(tmp_path, capsys, monkeypatch):
    """The rod's side meets the plate's inner end, 0.7 m out, before and after 0.52 rad.

    Half of each thickness is between its axis and that end: sin(a) = 0.00055 / 0.7, but for a
    half of the plate's thickness in 0.7 m.
    """
    output = tmp_path / "edge.png"
    monkeypatch.setattr(sys, "argv", ["sampled_and_proven", "--output", str(output)])
    main()
    said = capsys.readouterr().out
    assert "21 of 21 samples" in said and "COLLIDES" in said
    found = re.search(r"free up to ([\d.]+) and from ([\d.]+) on", said)
    assert found is not None
    half = math.asin(0.00055 / 0.7)
    assert float(found[1]) == pytest.approx(ANGLE - half, abs=3e-6)
    assert float(found[2]) == pytest.approx(ANGLE + half, abs=3e-6)
    with Picture.open(output) as picture:
        assert len(picture.convert("RGB").getcolors(1 << 20)) > 100
