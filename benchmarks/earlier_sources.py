"""Let the sources of an earlier commit answer in a process that takes turns with this one."""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
import os
from pathlib import Path
import subprocess
import sys
import tempfile

__all__ = ["ROOT", "Worker", "sources_of", "worker"]

ROOT = Path(__file__).parents[1]


@contextlib.contextmanager
def sources_of(commit: str) -> Iterator[Path]:
    """Give a folder with the package as it was at a commit."""
    with tempfile.TemporaryDirectory() as folder:
        archive = subprocess.run(
            ["git", "archive", commit, "scene_graph_ros"],
            cwd=ROOT,
            check=True,
            capture_output=True,
        )
        subprocess.run(["tar", "-x", "-C", folder], input=archive.stdout, check=True)
        yield Path(folder)


class Worker:
    """A process of a script that writes a line of text for each line that it gets."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        """Take a process whose input and output are pipes."""
        assert process.stdin is not None
        assert process.stdout is not None
        self._lines, self._answers = process.stdin, process.stdout

    def ask(self, line: str) -> str:
        """Return the answer to a line."""
        self._lines.write(line + "\n")
        self._lines.flush()
        answer = self._answers.readline()
        if not answer:
            raise RuntimeError("the process has ended")
        return answer.strip()


@contextlib.contextmanager
def worker(script: str, sources: Path, *arguments: str) -> Iterator[Worker]:
    """Give a process that runs a script over the package in the folder ``sources``."""
    with subprocess.Popen(
        [sys.executable, "-c", script, *arguments],
        cwd=sources,
        env={**os.environ, "PYTHONPATH": str(sources)},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        yield Worker(process)
