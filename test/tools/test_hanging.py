"""A test that hangs outside of Python fails, and the run ends and says which test it was."""

from __future__ import annotations

import os
from pathlib import Path
import subprocess
import sys
import tomllib

import pytest

ROOT = Path(__file__).parents[2]

# Waits for itself, holds the interpreter's lock, and goes on waiting after a signal.
HANGS = """
import ctypes

def test_first():
    pass

def test_hangs():
    mutex = ctypes.create_string_buffer(64)
    lock = ctypes.PyDLL(None).pthread_mutex_lock
    lock(mutex)
    lock(mutex)
"""


@pytest.mark.parametrize("workers", [(), ("-n", "2", "--max-worker-restart", "0")])
def test_what_hangs_ends_the_run_and_is_named(tmp_path, workers):
    """The project's own settings, with less patience."""
    tools = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]
    settings = tools["pytest"]["ini_options"]
    assert 0 < settings["timeout"] < settings["faulthandler_timeout"]
    exits = str(settings["faulthandler_exit_on_timeout"]).lower()
    (tmp_path / "test_one.py").write_text(HANGS)
    (tmp_path / "test_other.py").write_text("def test_other():\n    pass\n")
    plain = ["-p", "no:hypothesispytest", "-p", "no:cacheprovider", *workers]
    patience = ["--timeout", "1", "-o", "faulthandler_timeout=2"]
    patience += ["-o", f"faulthandler_exit_on_timeout={exits}"]
    done = subprocess.run(
        [sys.executable, "-m", "pytest", *plain, *patience, "."],
        cwd=tmp_path,
        env=os.environ,
        capture_output=True,
        text=True,
        timeout=100,
        check=False,
    )
    assert done.returncode == 1
    assert "in test_hangs" in done.stderr + done.stdout
    if workers:
        assert "crashed while running 'test_one.py::test_hangs'" in done.stdout
