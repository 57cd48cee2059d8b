"""The example whose robot looks: paths around what was seen, and no touch of what is there."""

from pathlib import Path
import re
import subprocess
import sys

ROOT = Path(__file__).parents[2]


def test_a_panda_plans_around_what_its_camera_saw_and_plans_again(surroundings):
    """It sees more on its way, stops at least once, and comes to its goal without a touch.

    Its moments are drawn as those of ``plan_in_the_world``, whose test looks at the picture.
    """
    done = subprocess.run(
        [sys.executable, "examples/look_and_plan.py", "--speed", "0.3"],
        cwd=ROOT,
        env=surroundings,
        capture_output=True,
        text=True,
        timeout=280,
        check=False,
    )
    text = done.stdout
    assert done.returncode == 0, text + done.stderr
    plans = re.findall(r"Plan \d+: .* proven to keep ([\d.]+) mm from everything", text)
    assert len(plans) >= 2, text
    assert min(map(float, plans)) >= 9.9
    stops = re.findall(r"sees more, (\d+) points by now, and stops: .*seen", text)
    assert len(stops) == len(plans) - 1
    first = int(re.search(r"The camera sees (\d+) points", text)[1])
    last = int(re.search(r"at its goal, and (\d+) points are seen", text)[1])
    assert 0 < first < last
    # The carton, the vase and the ball as they are, of which planning was not told.
    assert float(re.search(r"came no nearer than (-?\d+) mm", text)[1]) > 0.0
