"""The example with a mobile manipulator: described by a topic, moved by three senders."""

from pathlib import Path
import re
import subprocess
import sys

ROOT = Path(__file__).parents[2]


def test_the_hand_is_where_description_drivers_and_odometry_put_it(surroundings):
    """At the end of the drive, to rounding: the example itself compares, and fails where not."""
    done = subprocess.run(
        [sys.executable, "examples/mobile_manipulator.py"],
        cwd=ROOT,
        env=surroundings,
        capture_output=True,
        text=True,
        timeout=150,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "as its description says" in done.stdout
    assert re.search(r"The hand is at \(2\.\d+, .*\) m, \d\.\de-1\d m off", done.stdout)
