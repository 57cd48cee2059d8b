"""The example that covers an arm's free configurations: it says how much, and draws it."""

from pathlib import Path
import re
import sys

from PIL import Image as Picture

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "examples"))

from free_configurations import main  # noqa: E402


def test_what_is_free_is_covered_and_drawn(tmp_path, capsys, monkeypatch):
    """Most of it, as was asked for; regions are in the picture beside the graph."""
    output = tmp_path / "arm.png"
    monkeypatch.setattr(sys, "argv", ["free_configurations", "--output", str(output)])
    main()
    said = capsys.readouterr().out
    found = re.search(r"(\d+) regions have ([\d.]+) % .* at most ([\d.]+) % collides", said)
    assert found is not None
    assert int(found[1]) > 2 and float(found[2]) >= 90.0 and float(found[3]) <= 2.0
    with Picture.open(output) as picture:
        assert len(picture.convert("RGB").getcolors(1 << 20)) > 500
