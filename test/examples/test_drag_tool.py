"""The example of dragging: the node serves its page, and the robot that is played is heard."""

from pathlib import Path
import subprocess
import sys

ROOT = Path(__file__).parents[2]


def test_it_says_where_the_page_is():
    """And ends by itself, with the robot where it began."""
    command = [sys.executable, "examples/drag_tool.py", "--seconds", "0.2", "--port", "0"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    assert "opened with its token by" in done.stdout + done.stderr
    assert "the robot is at 0.00, -0.40, 0.00, -2.00, 0.00, 1.60, 0.80, 0.02" in done.stdout
