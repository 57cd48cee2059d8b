"""The example that plans in a live world: a path, a ball in its way, another path, executed."""

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
    assert re.search(r"does not hold any more: .*objects/ball/ball.* at [\d.]+ s\.", text)
    # The second leads around: it is longer, and no straight edge.
    lengths = [float(rad) for rad in re.findall(r"together ([\d.]+) rad", text)]
    assert lengths[0] < lengths[1]
    # At 100 Hz, as long as the trajectory takes, and no contact that was not there before.
    seconds = [float(s) for s in re.findall(r"rad in ([\d.]+) s", text)]
    moved = re.search(r"moved along it, in (\d+) joint states, and touched nothing\.", text)
    assert moved is not None, text
    assert abs(int(moved[1]) - 100.0 * seconds[1]) < 4.0
