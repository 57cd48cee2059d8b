"""The example that asks the node for the fastest way through regions, and moves there and back."""

from pathlib import Path
import re
import subprocess
import sys

from code_blocks import difference, transcript
import numpy as np
from PIL import Image
import pytest

ROOT = Path(__file__).parents[2]
START = np.array([-0.5, 0.3, 0.0, -2.0, 0.0, 2.3, 0.785])
GOAL = np.array([1.095, 0.135, 0.27, -2.219, -0.321, 3.6, 0.785])
"""Where the example says that it moves, rad."""
SPEEDS = np.array([2.175] * 4 + [2.61] * 3)
"""rad/s, of the URDF."""


def test_a_panda_moves_there_and_back_through_regions_that_grew_once(surroundings, tmp_path):
    """Nothing is touched, and both ways take what the slowest joint needs, or more."""
    picture = tmp_path / "way.png"
    done = subprocess.run(
        [
            *(sys.executable, "examples/regions_in_the_world.py", "--timeout", "100"),
            *("--picture", picture, "--samples", "1"),
        ],
        cwd=ROOT,
        env=surroundings,
        capture_output=True,
        text=True,
        timeout=250,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    text = done.stdout
    assert re.search(r"There: \d+ regions that grew, ", text)
    assert not difference(transcript("examples/regions_in_the_world.py") + "Picture: ...", text)
    assert re.search(r"And back: \d+ regions, ", text)
    assert text.count("touched nothing.") == 2
    there, back = (float(s) for s in re.findall(r"speeds alone limited ([\d.]+) s", text))
    needed = float((np.abs(GOAL - START) / SPEEDS).max())
    assert there >= needed - 5e-4
    assert back == pytest.approx(there, abs=1e-3)
    assert max(float(g) for g in re.findall(r"more than (\S+) s faster", text)) < 1e-4
    # The way's colours: some green and some orange of full strength are in the picture.
    pixels = np.asarray(Image.open(picture).convert("RGB"), dtype=int).reshape(-1, 3)
    for color in ((0, 191, 26), (242, 115, 13)):
        assert (np.abs(pixels - color).max(axis=1) < 12).any()
