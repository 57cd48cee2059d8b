"""The example that certifies regions: they grow, their proofs hold, and they are drawn."""

from __future__ import annotations

from pathlib import Path
import re
import sys

from PIL import Image as Picture

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "examples"))

from certified_regions import main  # noqa: E402


def test_regions_grow_from_proof_to_proof(tmp_path, capsys):
    """The first has the area that it was given; the last is proven by distances, too."""
    picture = tmp_path / "a.png"
    assert main(["--rounds", "2", "--output", str(picture)]) == 0
    told = capsys.readouterr().out
    areas = [float(area) for area in re.findall(r"area ([\d.]+) of s, .* the proof holds", told)]
    assert len(areas) == 3
    assert areas[0] == 0.04
    assert areas == sorted(areas)
    assert areas[-1] > 5.0 * areas[0]
    assert "the last one is proven" in told
    with Picture.open(picture) as image:
        assert len(image.convert("RGB").getcolors(1 << 20)) > 100
