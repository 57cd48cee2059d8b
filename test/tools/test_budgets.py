"""Each folder has its share of the tests' time, and a run says which one took more."""

from __future__ import annotations

import os
from pathlib import Path
import subprocess
import sys
import tomllib
from types import SimpleNamespace

from budgets import Budgets
import pytest

ROOT = Path(__file__).parents[2]
SUPPORT = ROOT / "test" / "support"

OPTIONS = """
[tool.budgets.all]
"quick" = {quick}
"waits" = {waits}
"""

QUICK = "def test_nothing():\n    pass\n"
WAITS = "import threading\n\ndef test_wait():\n    assert not threading.Event().wait(0.3)\n"


def report(nodeid, duration):
    """Return what is read of a report."""
    return SimpleNamespace(nodeid=nodeid, duration=duration)


def test_the_longest_path_that_fits_counts():
    """A folder in a folder, or a file, may have a share of its own."""
    budgets = Budgets({"test/a": 0.5, "test/a/b": 0.5, "test/a/b/test_c.py": 0.5})
    for nodeid, seconds in (
        ("test/a/test_x.py::test", 1.0),
        ("test/a/b/test_x.py::test[test/a]", 2.0),
        ("test/a/b/test_c.py::test", 4.0),
        ("test/a/bb/test_x.py::test", 8.0),
    ):
        budgets.pytest_runtest_logreport(report(nodeid, seconds))
    assert budgets.seconds == {"test/a": 9.0, "test/a/b": 2.0, "test/a/b/test_c.py": 4.0}
    (problem,) = budgets.problems()
    assert problem == "test/a took 60.0%, and may take 50.0%"


def test_every_folder_of_tests_has_a_share():
    """Said by this test, before the run's end."""
    tables = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["budgets"]
    shares = [ROOT / folder for table in tables.values() for folder in table]
    without = {
        test.parent
        for test in ROOT.glob("test/**/test_*.py")
        if not any(test.is_relative_to(folder) for folder in shares)
    }
    assert not without, "give them shares in pyproject.toml"


def test_a_folder_without_a_share_is_named():
    """Whoever adds one says what it may take."""
    budgets = Budgets({"test/a": 1.0})
    budgets.pytest_runtest_logreport(report("test/b/test_x.py::test", 0.0))
    assert budgets.problems() == ["test/b/test_x.py has no share"]


@pytest.fixture
def run(tmp_path):
    """Run a quick test and one that waits, with shares for both, and options."""

    def run_with(quick, waits, *options):
        (tmp_path / "pyproject.toml").write_text(
            "[tool.pytest.ini_options]\n" + OPTIONS.format(quick=quick, waits=waits)
        )
        for folder, text in (("quick", QUICK), ("waits", WAITS)):
            (tmp_path / folder).mkdir(exist_ok=True)
            (tmp_path / folder / f"test_{folder}.py").write_text(text)
        plain = ["-p", "budgets", "-p", "no:hypothesispytest", "--budget", "all"]
        return subprocess.run(
            [sys.executable, "-m", "pytest", *plain, *options, "quick", "waits"],
            cwd=tmp_path,
            env={**os.environ, "PYTHONPATH": str(SUPPORT)},
            capture_output=True,
            text=True,
            timeout=100,
            check=False,
        )

    return run_with


@pytest.mark.parametrize("options", [(), ("-n", "2")], ids=["one process", "workers"])
def test_a_run_says_which_folder_takes_more_than_its_share(run, options):
    """Each test is counted once, wherever it ran; time fails no run."""
    done = run(1.0, 0.5, *options)
    assert done.returncode == 0, done.stdout
    assert "2 passed" in done.stdout
    (line,) = (line for line in done.stdout.splitlines() if line.startswith("over budget"))
    assert line.startswith("over budget: waits took ")
    done = run(0.5, 1.0, *options)
    assert done.returncode == 0, done.stdout
    assert "over budget" not in done.stdout
