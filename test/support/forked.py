"""Processes forked from one that has done the long imports of the node already.

An interpreter that starts imports numba and rclpy for two seconds before it runs anything of ours,
and what numba reads before the first kernel, whichever that is, takes most of another second. The
standard library's fork server does so once for all processes that tests start through it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import contextlib
import functools
import multiprocessing
from multiprocessing import forkserver
import os
from pathlib import Path
import signal
import subprocess
import sys
import tempfile
import threading

from workspace_messages import WORKSPACE_VARIABLES

__all__ = ["ForkedProcess", "run_forked"]

PRELOADED = ["scene_graph_ros.node.process", "begun_before"]
"""What a node that starts imports first; its effects are imported when they are asked for."""

_server = multiprocessing.get_context("forkserver")
_server.set_forkserver_preload(PRELOADED)


class ForkedProcess:
    """Runs ``program`` as ``python -c`` does, as far as `subprocess.Popen` is needed of that."""

    def __init__(
        self, program: str, arguments: Sequence[str], environment: Mapping[str, str], log: Path
    ) -> None:
        """Start it; what it prints goes to the file ``log``."""
        _ensure_server_runs()
        inputs = (program, ["-c", *arguments], dict(environment), str(log))
        self._process = _server.Process(target=_run, args=inputs, daemon=True)
        self._process.start()
        assert self._process.pid is not None
        self.pid = self._process.pid

    @property
    def returncode(self) -> int | None:
        """The exit code as `poll` or `wait` saw it; minus the signal that killed it."""
        return self._process.exitcode

    def poll(self) -> int | None:
        """Return the exit code, or None while it runs."""
        return self.returncode

    def wait(self, timeout: float | None = None) -> int:
        """Wait for the end and return the exit code."""
        self._process.join(timeout)
        if self.returncode is None:
            raise subprocess.TimeoutExpired(PRELOADED[0], timeout or 0.0)
        return self.returncode

    def send_signal(self, number: int) -> None:
        """Send a signal, unless it has ended."""
        if self.poll() is None:
            with contextlib.suppress(ProcessLookupError):
                os.kill(self.pid, number)

    def kill(self) -> None:
        """End it at once."""
        self._process.kill()


def run_forked(
    program: str, arguments: Sequence[str], environment: Mapping[str, str], timeout: float
) -> tuple[int, str]:
    """Run a program to its end; return its exit code and all that it printed."""
    with tempfile.NamedTemporaryFile("r", suffix=".log") as log:
        process = ForkedProcess(program, arguments, environment, Path(log.name))
        try:
            code = process.wait(timeout)
        finally:
            process.kill()
        return code, log.read()


@functools.cache
def _ensure_server_runs() -> None:
    """Start the server with this folder among those that it imports from; our path is not its.

    The dynamic linker reads once where libraries are: also those of the test workspace, which a
    forked process finds when its variables name the modules that need them.
    """
    added = {
        "PYTHONPATH": str(Path(__file__).parent),
        "LD_LIBRARY_PATH": WORKSPACE_VARIABLES["LD_LIBRARY_PATH"],
    }
    before = {name: os.environ.get(name) for name in added}
    for name, folder in added.items():
        os.environ[name] = os.pathsep.join([folder, *filter(None, [before[name]])])
    try:
        forkserver.ensure_running()
    finally:
        for name, value in before.items():
            del os.environ[name]
            if value is not None:
                os.environ[name] = value


def _end_with_parent() -> None:
    """Be killed when the tests are gone: this process keeps the fork server alive, not it this."""
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os.kill(os.getpid(), signal.SIGKILL)


def _run(program: str, arguments: list[str], environment: dict[str, str], log: str) -> None:
    """Become what the program makes of this process."""
    # A node that outlived its tests, however they ended, would answer others' tests.
    threading.Thread(target=_end_with_parent, daemon=True).start()
    output = os.open(log, os.O_WRONLY | os.O_APPEND | os.O_CREAT)
    for stream in (sys.stdout, sys.stderr):
        os.dup2(output, stream.fileno())
        stream.reconfigure(line_buffering=True, write_through=True)
    os.close(output)
    os.chdir(Path(__file__).parents[2])
    os.environ.clear()
    os.environ.update(environment)
    folders = environment.get("PYTHONPATH", "").split(os.pathsep)
    sys.path[:0] = [folder for folder in folders if folder and folder not in sys.path]
    sys.argv = arguments
    exec(compile(program, "<program>", "exec"), {"__name__": "__main__"})
