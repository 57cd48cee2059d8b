"""Say where a run's time went, and which folder took more than its share.

``--budget RUN`` names the table in `pyproject.toml`, ``[tool.budgets.RUN]``, which gives each
folder that is run the share of all tests' time that it may take. Shares and not seconds: machines
differ, and one that is busy is slow in all folders alike. Time never fails a run.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
import tomllib
from typing import Any

__all__ = ["Budgets", "pytest_addoption", "pytest_configure"]


class Budgets:
    """Adds up what the tests below each folder take."""

    def __init__(self, shares: Mapping[str, float]) -> None:
        """Take the shares that folders, or files, may have; the longest that fits counts."""
        self.shares = dict(sorted(shares.items(), key=lambda item: -len(item[0])))
        self.seconds = dict.fromkeys(shares, 0.0)
        self.without_share: set[str] = set()

    def pytest_runtest_logreport(self, report: Any) -> None:
        """Add what a test, its set-up or its end took; workers' reports come here as well."""
        path = Path(report.nodeid.partition("::")[0])
        for folder in self.shares:
            if path.is_relative_to(folder):
                self.seconds[folder] += report.duration
                return
        self.without_share.add(str(path))

    def problems(self) -> list[str]:
        """Return a line for each folder that took too much, or has no share."""
        whole = sum(self.seconds.values()) or 1.0
        return [
            *(f"{path} has no share" for path in sorted(self.without_share)),
            *(
                f"{folder} took {seconds / whole:.1%}, and may take {self.shares[folder]:.1%}"
                for folder, seconds in self.seconds.items()
                if seconds > self.shares[folder] * whole
            ),
        ]

    def pytest_terminal_summary(self, terminalreporter: Any) -> None:
        """Print the table."""
        whole = sum(self.seconds.values()) or 1.0
        terminalreporter.section("time of each folder")
        for folder, seconds in sorted(self.seconds.items(), key=lambda item: -item[1]):
            share = f"{seconds / whole:6.1%} of at most {self.shares[folder]:6.1%}"
            terminalreporter.write_line(f"{folder:32}{seconds:8.1f} s {share}")
        for problem in self.problems():
            terminalreporter.write_line(f"over budget: {problem}", red=True)


def pytest_addoption(parser: Any) -> None:
    """Add ``--budget``."""
    parser.addoption("--budget", metavar="RUN", help="print the folders' shares of the time")


def pytest_configure(config: Any) -> None:
    """Add up where all reports come together: not in the workers of pytest-xdist."""
    name = config.getoption("--budget")
    if name and not hasattr(config, "workerinput"):
        tables = tomllib.loads(Path(config.rootpath, "pyproject.toml").read_text())
        config.pluginmanager.register(Budgets(tables["tool"]["budgets"][name]))
