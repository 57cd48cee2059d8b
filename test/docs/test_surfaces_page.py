"""The page on contact surfaces says what is true: its example runs, and gives what it should."""

from pathlib import Path
import re
import subprocess
import sys

import pytest

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "surfaces.md").read_text()


def test_the_example_prints_the_ball_s_force_and_area():
    """A ball of 10 cm, 1 cm deep, at 1 MPa: the disk's area, and the field integrated over it.

    Area pi (R^2 - h^2) with h = 9 cm; force 2 pi E / R (R (R^2 - h^2) / 2 - (R^3 - h^3) / 3). It
    presses the table, which is M, down.
    """
    code = re.search(r"```python\n(.*?)```", PAGE, re.S)
    assert code
    result = subprocess.run(
        [sys.executable, "-c", code.group(1)], cwd=ROOT, capture_output=True, text=True, check=True
    )
    is_table, force, area = re.fullmatch(r"(\w+) -(\d+) N on (\d+) cm²\n", result.stdout).groups()
    R, h = 0.1, 0.09
    truth = 2.0 * 3.14159265 * 1e6 / R * (R * (R * R - h * h) / 2.0 - (R**3 - h**3) / 3.0)
    assert is_table == "True"
    assert float(force) == pytest.approx(truth, rel=0.03)
    assert float(area) == pytest.approx(1e4 * 3.14159265 * (R * R - h * h), rel=0.03)
