"""The README says what is true: its example prints what it shows."""

from pathlib import Path
import re
import subprocess
import sys

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text()


def _block_after(heading: str, language: str) -> str:
    """Return the first code block of ``language`` below ``heading``."""
    section = README.split(f"## {heading}\n", 1)[1]
    match = re.search(rf"```{language}\n(.*?)```", section, re.S)
    assert match, f"no {language or 'plain'} block below '{heading}'"
    return match.group(1)


def test_the_core_example_prints_what_the_readme_shows():
    """The ten lines run as they stand and print the block below them."""
    code = _block_after("The core in ten lines", "python")
    shown = README.split(code, 1)[1].split("```\n", 3)[2]
    result = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert result.stdout == shown


def test_the_node_example_is_valid_and_publishes():
    """The node's ten lines compile and end with publishing on the source's pose topic."""
    code = _block_after("The node in ten lines", "python")
    compile(code, "README.md", "exec")
    assert '"objects/poses"' in code
    assert "publisher.publish(message)" in code
