"""The example that plans in a live world: a path, a ball in its way, another path."""

from pathlib import Path
import re
import subprocess
import sys

ROOT = Path(__file__).parents[2]


def test_a_ball_in_the_way_is_noticed_and_gone_around(surroundings):
    """Both paths keep the padding of 10 mm, and hold when they are found."""
    done = subprocess.run(
        [sys.executable, "examples/plan_in_the_world.py", "--timeout", "100"],
        cwd=ROOT,
        env=surroundings,
        capture_output=True,
        text=True,
        timeout=250,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    text = done.stdout
    kept = [float(mm) for mm in re.findall(r"proven to keep ([\d.]+) mm", text)]
    assert len(kept) == 2
    assert min(kept) >= 10.0
    assert text.count("It holds in the world as it is.") == 2
    assert re.search(r"does not hold any more: .*objects/ball/ball.* of edge \d", text)
    # The second leads around: it is longer, and no straight edge.
    lengths = [float(rad) for rad in re.findall(r"together ([\d.]+) rad", text)]
    assert lengths[0] < lengths[1]
