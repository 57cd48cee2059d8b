"""The example that plans in a live world: a grasp, a path, a ball in its way, another path."""

from pathlib import Path
import re
import subprocess
import sys

from code_blocks import difference, transcript
import numpy as np
from PIL import Image

from scene_graph_ros.planning import load_robot_diagram

ROOT = Path(__file__).parents[2]
SCENE = ROOT / "config" / "scenes" / "panda_cell.yaml"
GOAL = (1.37, 0.75, 0.17, -0.51, 2.53, 3.09, -0.12, 0.02)
"""Where the example says that it goes (rad, m)."""
DEPTH = 0.14
"""Metres before the hand: where it has the box."""
BOARD = 0.78
"""Metres: how high the shelf's middle board is."""


def run_example(surroundings, *arguments):
    """Return the ended process of the example."""
    return subprocess.run(
        [sys.executable, "examples/plan_in_the_world.py", *arguments],
        cwd=ROOT,
        env=surroundings,
        capture_output=True,
        text=True,
        timeout=250,
        check=False,
    )


def test_a_ball_in_the_way_of_a_carried_box_is_noticed_and_gone_around(surroundings, tmp_path):
    """Both paths keep the padding of 5 mm, and hold when they are found; nothing is touched."""
    picture = tmp_path / "frames.png"
    done = run_example(surroundings, "--timeout", "100", "--picture", picture, "--samples", "1")
    assert done.returncode == 0, done.stdout + done.stderr
    text = done.stdout
    assert "The hand has grasped a box of 16 cm." in text
    assert not difference(transcript("examples/plan_in_the_world.py") + "Picture: ...", text)
    kept = [float(mm) for mm in re.findall(r"proven to keep ([\d.]+) mm", text)]
    assert len(kept) == 2
    assert min(kept) >= 5.0
    assert text.count("It holds in the world as it is.") == 2
    assert re.search(r"does not hold any more: .*objects/ball/ball.* at [\d.]+ s\.", text)
    # At 100 Hz, as long as the trajectory takes, and no contact that was not there before.
    seconds = [float(s) for s in re.findall(r"rad in ([\d.]+) s", text)]
    moved = re.search(r"moved along it, in (\d+) joint states, and touched nothing\.", text)
    assert moved is not None, text
    assert abs(int(moved[1]) - 100.0 * seconds[1]) < 4.0
    # The box is where the last configuration of the robot has it, above the middle board.
    tree = load_robot_diagram(SCENE).tree
    X_WH = tree.link_poses(np.array(GOAL), ["panda_hand"])[0]
    expected = X_WH[:3, 3] + DEPTH * X_WH[:3, 2]
    found = re.search(r"lets go of the box at \((.*)\) m\.", text)
    assert found is not None, text
    np.testing.assert_allclose([float(p) for p in found[1].split(",")], expected, atol=0.0051)
    assert expected[2] > BOARD
    # Three frames, of the path, of what stops it, and of the other one, none of which is another.
    frames = np.array_split(np.asarray(Image.open(picture).convert("RGB"), dtype=float), 3, axis=1)
    for k in range(3):
        assert np.abs(frames[k] - frames[k - 1]).mean() > 1.0


def test_without_time_there_is_no_path_and_the_reason_is_told(surroundings):
    """And the exit code says so; the node ends as it should."""
    done = run_example(surroundings, "--timeout", "1e-6")
    assert done.returncode == 1, done.stdout + done.stderr
    assert "No path: no path was found" in done.stdout
