"""The pages on robots and planning: their examples print what they show."""

from pathlib import Path
import re
import subprocess
import sys

import pytest

ROOT = Path(__file__).parents[2]


_BLOCK = re.compile(r"```python\n(.*?)```\n(?:\n```\n(.*?)```)?", re.S)
_MARK = "--- the next block ---"


@pytest.mark.parametrize("name", ["planning", "robots"])
def test_the_examples_print_what_the_page_shows(name):
    """All blocks run as they stand, one after the other; what a block prints follows it."""
    page = (ROOT / "docs" / f"{name}.md").read_text()
    blocks = _BLOCK.findall(page)
    code = f"print({_MARK!r})\n".join(code for code, _ in blocks)
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    printed = done.stdout.split(f"{_MARK}\n")
    assert printed == [shown for _, shown in blocks]
