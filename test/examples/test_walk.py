"""The example that walks keeps its zero-moment point under its feet."""

from pathlib import Path
import re
import subprocess
import sys

import matplotlib.image

ROOT = Path(__file__).parents[2]


def test_talos_takes_two_steps(tmp_path):
    """The legs reach, all links' zero-moment point is near the desired one, and it is drawn."""
    picture = tmp_path / "walk.png"
    done = subprocess.run(
        [sys.executable, "examples/walk.py", "--steps", "2", "--output", str(picture)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=250,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    pendulum, links = map(float, re.findall(r"point: ([0-9.]+) mm", done.stdout))
    # A sole is 120 mm wide.
    assert pendulum < 10.0
    assert links < 30.0
    assert matplotlib.image.imread(picture)[..., :3].std() > 0.05
