"""The page on robots: its example prints what it shows."""

from pathlib import Path
import re
import subprocess
import sys

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "robots.md").read_text()


def test_the_example_prints_what_the_page_shows():
    """The lines run as they stand."""
    code, shown = re.search(r"```python\n(.*?)```\n\n```\n(.*?)```", PAGE, re.S).groups()
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout == shown
