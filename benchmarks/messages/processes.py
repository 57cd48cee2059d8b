"""Processes of the message benchmarks, on a ROS domain of their own, and what they use."""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
from dataclasses import dataclass
import json
import os
from pathlib import Path
import random
import signal
import subprocess
import sys
import tempfile
from typing import Any

import domain_coordinator

__all__ = ["ROOT", "Isolation", "Sender", "cpu_seconds", "isolated", "resident_bytes"]

ROOT = Path(__file__).parents[2]
_STOP_SECONDS = 30.0


def cpu_seconds(pid: int) -> float:
    """Return the processor time that a process has used."""
    fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def resident_bytes(pid: int) -> int:
    """Return the memory that a process has in use."""
    pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE")


@dataclass
class Isolation:
    """A domain, a folder for files, and the processes started in it."""

    domain: int
    folder: Path
    children: list[subprocess.Popen[Any]]

    def start(self, *module: str, **options: Any) -> subprocess.Popen[Any]:
        """Start ``python -m`` with arguments in this domain; what it logs is kept in a file."""
        return self._start([sys.executable, "-m", *module], **options)

    def start_script(self, path: Path, *arguments: str) -> subprocess.Popen[Any]:
        """Start a script in this domain."""
        return self._start([sys.executable, str(path), *arguments])

    def _start(self, command: list[str], **options: Any) -> subprocess.Popen[Any]:
        path = os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])
        environment = {
            **os.environ,
            "PYTHONPATH": path.rstrip(os.pathsep),
            "ROS_DOMAIN_ID": str(self.domain),
        }
        log = (self.folder / f"{len(self.children)}.log").open("w")
        # Whatever a shell starts in the background ignores SIGINT, and so would this.
        command = ["env", "--default-signal=INT", *command]
        child = subprocess.Popen(command, env=environment, cwd=ROOT, stderr=log, **options)
        log.close()
        self.children.append(child)
        return child

    def start_node(self, scene: str | Path, **parameters: Any) -> subprocess.Popen[Any]:
        """Start the node with a scene file, or with the text of one."""
        if isinstance(scene, str):
            path = self.folder / f"scene_{len(self.children)}.yaml"
            path.write_text(scene)
            scene = path
        arguments = ["--ros-args", "-p", f"scene:={scene}"]
        for name, value in parameters.items():
            arguments += ["-p", f"{name}:={value}"]
        return self.start("scene_graph_ros.node", *arguments)

    def stop(self, child: subprocess.Popen[Any]) -> None:
        """End a process."""
        if child.poll() is None:
            child.send_signal(signal.SIGINT)
        try:
            child.wait(_STOP_SECONDS)
        except subprocess.TimeoutExpired:
            child.kill()
            child.wait()

    def ask(self, child: subprocess.Popen[Any], **question: Any) -> None:
        """Write a line of JSON to a process."""
        assert child.stdin is not None
        child.stdin.write(json.dumps(question) + "\n")
        child.stdin.flush()

    def answer(self, child: subprocess.Popen[Any]) -> dict[str, Any]:
        """Return the next line of JSON that a process writes, among what the middleware says."""
        assert child.stdout is not None
        for line in child.stdout:
            if line.startswith("{"):
                answer: dict[str, Any] = json.loads(line)
                return answer
        child.wait()
        self.check()
        raise RuntimeError(f"{child.args} ended without an answer")

    def check(self) -> None:
        """Raise RuntimeError where a process ended by itself."""
        for index, child in enumerate(self.children):
            if child.poll() not in (None, 0):
                log = (self.folder / f"{index}.log").read_text()
                raise RuntimeError(f"{child.args} ended with {child.returncode}:\n{log}")


@contextlib.contextmanager
def isolated() -> Iterator[Isolation]:
    """Give a domain that nobody else on this machine uses; end its processes at the end."""
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    # At random: in one that was just left, processes that were killed still seem to be.
    reserved = domain_coordinator.domain_id(lambda: random.randint(1, 100))
    with tempfile.TemporaryDirectory() as folder, reserved as domain:
        isolation = Isolation(domain, Path(folder), [])
        try:
            yield isolation
        finally:
            for child in isolation.children:
                isolation.stop(child)


class Sender:
    """A process that publishes poses at a rate on demand; see ``benchmarks.messages.sender``."""

    def __init__(self, isolation: Isolation, count: int) -> None:
        self._isolation = isolation
        self.process = isolation.start(
            "benchmarks.messages.sender",
            *("--frames", str(count)),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def begin(self, rate: float, seconds: float) -> None:
        """Publish for some seconds; returns at once."""
        self._isolation.ask(self.process, rate=rate, seconds=seconds)

    def end(self) -> int:
        """Wait until it has published and return how many messages."""
        return int(self._isolation.answer(self.process)["sent"])
