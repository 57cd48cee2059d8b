"""The example of a timed path: limits are kept, and made use of."""

from pathlib import Path
import re
import sys

from PIL import Image as Picture

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "examples"))

from timed_path import main  # noqa: E402


def test_limits_are_kept_and_made_use_of(tmp_path, capsys, monkeypatch):
    """Nothing is above its limit, and something is near one nearly all the time."""
    output = tmp_path / "timed.png"
    monkeypatch.setattr(sys, "argv", ["timed_path", "--output", str(output)])
    assert main() == 0
    said = capsys.readouterr().out
    found = re.search(r"speeds up to ([\d.]+), accelerations up to ([\d.]+);.* (\d+)% of", said)
    assert found is not None
    assert float(found[1]) <= 1.0
    assert 0.99 <= float(found[2]) <= 1.0
    assert int(found[3]) >= 95
    with Picture.open(output) as picture:
        assert len(picture.convert("RGB").getcolors(1 << 20)) > 100
