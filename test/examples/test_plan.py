"""The example of planning finds a way, and says so of what it can't."""

from pathlib import Path
import subprocess
import sys

ROOT = Path(__file__).parents[2]


def run(*arguments):
    """Return what the example did."""
    return subprocess.run(
        [sys.executable, "examples/plan_around_shelf.py", "--no-picture", *arguments],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=250,
        check=False,
    )


def test_the_hand_goes_from_one_compartment_into_the_next():
    """It keeps the 5 mm that it is told to keep, and ends where it should."""
    done = run("--timeout", "100")
    assert done.returncode == 0, done.stdout + done.stderr
    first, *rows = done.stdout.splitlines()
    kept = float(first.split("proven to keep ")[1].split(" mm")[0])
    assert kept >= 5.0
    assert rows[0].split()[-8:] == [
        "1.07",
        "1.31",
        "0.81",
        "-1.17",
        "2.78",
        "2.67",
        "-1.38",
        "0.02]",
    ]
    assert len(rows) > 2


def test_a_box_in_the_hand_takes_another_way():
    """The path without it would hit, the one that is found does not."""
    done = run("--grasp", "--timeout", "100")
    assert done.returncode == 0, done.stdout + done.stderr
    hit, found, *_ = done.stdout.splitlines()
    assert "edges collide: grasp/" in hit
    assert int(hit.split(" of ")[0].split()[-1]) >= 1
    assert float(found.split("proven to keep ")[1].split(" mm")[0]) >= 5.0


def test_without_time_there_is_a_reason():
    """And an exit code."""
    done = run("--timeout", "0")
    assert done.returncode == 1
    assert done.stdout.startswith("no path was found within 0 s: the trees")
