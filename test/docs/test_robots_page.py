"""The pages on robots and planning: their examples print what they show."""

from pathlib import Path
import re
import subprocess
import sys

import pytest

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("name", ["planning", "robots"])
def test_the_example_prints_what_the_page_shows(name):
    """The lines run as they stand."""
    page = (ROOT / "docs" / f"{name}.md").read_text()
    code, shown = re.search(r"```python\n(.*?)```\n\n```\n(.*?)```", page, re.S).groups()
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout == shown
