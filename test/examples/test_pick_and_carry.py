"""The example that picks a can of the node's own scene from the table, carries and places it."""

import ast
from pathlib import Path
import re
import subprocess
import sys

from PIL import Image
import pytest

ROOT = Path(__file__).parents[2]
EXAMPLE = ROOT / "examples" / "pick_and_carry.py"
THERE = (0.45, 0.4, 0.515)
"""Where the example puts the can, as high as it was (m)."""


def test_the_users_part_is_at_most_sixty_lines():
    """Without blank lines, of the class that says what is to be done."""
    text = EXAMPLE.read_text()
    (task,) = (n for n in ast.parse(text).body if isinstance(n, ast.ClassDef))
    lines = text.splitlines()[task.lineno - 1 : task.end_lineno]
    assert len([line for line in lines if line.strip()]) <= 60


def test_a_can_is_picked_carried_and_placed(surroundings, tmp_path):
    """Nothing is touched on the way, and the can is where it was to be put."""
    picture = tmp_path / "frames.png"
    done = subprocess.run(
        [sys.executable, EXAMPLE, "--picture", picture, "--samples", "1"],
        cwd=ROOT,
        env=surroundings,
        capture_output=True,
        text=True,
        timeout=250,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    moves = re.findall(r"^(.*): \d+ joint states, and touched nothing\.$", done.stdout, re.M)
    assert moves == ["To the can", "With the can", "Away"], done.stdout
    found = re.search(r"The can is at \((.*)\) m\.", done.stdout)
    assert found is not None
    assert [float(v) for v in found[1].split(",")] == pytest.approx(THERE, abs=1e-3)
    assert Image.open(picture).width > 1000
