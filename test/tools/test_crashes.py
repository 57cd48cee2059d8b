"""A test that takes its process down ends the run, and is named."""

from pathlib import Path
import re
import subprocess
import sys

ROOT = Path(__file__).parents[2]

CRASHES = """
import os

def test_that_aborts():
    os.abort()

def test_behind_it():
    pass
"""

PASSES = """
import pytest

@pytest.mark.parametrize("i", range(20))
def test_that_passes(i):
    pass
"""


def test_a_run_ends_where_a_process_crashes(tmp_path):
    """With the options of `make test`, by which files share processes."""
    (options,) = re.findall(r"^IN_FILES := (.+)$", (ROOT / "Makefile").read_text(), re.MULTILINE)
    (tmp_path / "test_a.py").write_text(CRASHES)
    for name in "bcd":
        (tmp_path / f"test_{name}.py").write_text(PASSES)
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "-n", "2"]
    done = subprocess.run(
        [*command, *options.split(), "--rootdir", tmp_path, tmp_path],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=200,
        check=False,
    )
    assert done.returncode == 1, done.stdout + done.stderr
    assert "crashed while running 'test_a.py::test_that_aborts'" in done.stdout
