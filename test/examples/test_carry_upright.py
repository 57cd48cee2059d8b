"""The example that carries a cup keeps it upright, and tilts it where nothing forbids that."""

from pathlib import Path
import subprocess
import sys

ROOT = Path(__file__).parents[2]


def test_the_cup_stays_upright():
    """By the samples that the example takes itself."""
    done = subprocess.run(
        [sys.executable, "examples/carry_upright.py", "--no-picture", "--timeout", "100"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=250,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    proven, sampled, free = done.stdout.splitlines()
    assert float(proven.split("proven to keep ")[1].split(" mm")[0]) >= 5.0
    assert float(sampled.split(": ")[1].split(" rad")[0]) <= 0.05
    assert float(free.split("tilted by ")[1].split(" rad")[0]) > 0.5
