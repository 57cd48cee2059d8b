"""The example of jogging: the hand goes where it may, and the distance is kept."""

from pathlib import Path
import re
import sys

from PIL import Image as Picture

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "examples"))

import jog  # noqa: E402


def test_the_hand_goes_on_until_something_is_in_the_way(tmp_path, capsys, monkeypatch):
    """Down it comes to the table, in fewer ticks than a reader's, and not nearer than 20 mm."""
    output = tmp_path / "jog.png"
    monkeypatch.setattr(sys, "argv", ["jog", "--output", str(output)])
    monkeypatch.setattr(jog, "PERIOD", 0.01)
    assert jog.main() == 0
    said = capsys.readouterr().out
    found = re.search(r"ways by ([\d., ]+) m/s of .* nearer than ([\d.]+) mm", said)
    assert found is not None
    assert max(float(each) for each in found[1].split(", ")) > 0.1
    assert 20.0 <= float(found[2]) <= 25.0
    with Picture.open(output) as picture:
        assert len(picture.convert("RGB").getcolors(1 << 20)) > 50
