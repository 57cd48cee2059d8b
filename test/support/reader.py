"""A reader who runs a page's blocks one after another, in a folder and on a domain of their own.

Python runs in one process for each block, or in one for the page where the page says that its
blocks follow each other. A command that goes on until Ctrl-C, such as the node, is waited for
until it says that it runs, and gets its Ctrl-C at the end of the page, or before the next command
of its block. A block whose first line is a comment with a file's name is that file.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack
import json
import os
from pathlib import Path
import re
import shlex
import shutil
import signal
import subprocess
import sys
import threading
import time
from typing import Any
import xml.etree.ElementTree as ET

from code_blocks import Block, difference, DRAWN, ROOT
import trimesh
import yaml

from scene_graph_ros.check import Checker
from scene_graph_ros.scene_files.packages import Packages

__all__ = ["FOLLOW_EACH_OTHER", "Reader"]

FOLLOW_EACH_OTHER = "blocks of this page follow each other"
"""A page that says so has one process of Python."""
DEADLINE = 240.0
"""Seconds for a block, on a busy machine."""

_LASTING = re.compile(r"-m scene_graph_ros\.node\b|# until Ctrl-C|# in another terminal")
_RUNS = re.compile(r"running:|recording|waiting|publish", re.I)
"""What a command that goes on says when it has begun."""
_FILE = re.compile(r"(?:#|<!--) ([\w./-]+\.\w+)(?: -->)?\n")
_SUPPORT = Path(__file__).parent
_ONE_CHECKS = threading.Lock()
"""Pages are read in two threads, and warnings about meshes are told to one."""


class Process:
    """A command that goes on, with what it has printed."""

    def __init__(self, command: str, folder: Path, variables: dict[str, str]) -> None:
        self.command = command
        self._log = folder / f"output_{time.monotonic_ns()}.log"
        with self._log.open("w") as log:
            self._process = subprocess.Popen(
                ["setpriv", "--pdeathsig", "KILL", "--", "bash", "-c", f"exec {command}"],
                cwd=folder,
                env=variables,
                stdout=log,
                stderr=subprocess.STDOUT,
            )

    def wait_until_it_runs(self) -> None:
        """Wait as a reader does, who looks at what it prints."""
        end = time.monotonic() + DEADLINE
        while not _RUNS.search(self._log.read_text(errors="replace")):
            assert self._process.poll() is None, f"{self.command} ended:\n{self._log.read_text()}"
            assert time.monotonic() < end, f"{self.command}: {self._log.read_text()}"
            time.sleep(0.02)

    def interrupt(self) -> None:
        """Press Ctrl-C; fails where it ends with anything but success."""
        if self._process.poll() is None:
            self._process.send_signal(signal.SIGINT)
        try:
            code = self._process.wait(DEADLINE)
        finally:
            self._process.kill()
        assert code == 0, f"{self.command} ended with {code}:\n{self._log.read_text()}"


class Session:
    """A process of Python that runs blocks."""

    def __init__(self, folder: Path, variables: dict[str, str]) -> None:
        self._process = subprocess.Popen(
            [sys.executable, str(_SUPPORT / "block_driver.py")],
            cwd=folder,
            env=variables,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    def run(self, block: Block) -> str:
        """Return what a block prints; fails where it raises."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        request = {"page": block.page.name, "line": block.line, "text": block.text}
        self._process.stdin.write(json.dumps(request) + "\n")
        self._process.stdin.flush()
        timer = threading.Timer(DEADLINE, self._process.kill)
        timer.start()
        line = self._process.stdout.readline()
        timer.cancel()
        assert line, f"{block.place}: Python ended, {self._process.communicate()[1]}"
        answer: dict[str, str] = json.loads(line)
        assert not answer["error"], f"{block.place}:\n{answer['error']}"
        return answer["printed"]

    def close(self) -> None:
        """End it as a script ends."""
        self._process.communicate(timeout=DEADLINE)


def commands(text: str) -> Iterator[str]:
    """Yield the commands of a block of shell, each with its continued lines."""
    pending = ""
    for line in text.splitlines():
        pending += line
        if pending.endswith("\\"):
            pending = pending[:-1]
            continue
        try:
            shlex.split(pending, comments=True)
        except ValueError:  # a quotation goes on in the next line
            pending += "\n"
            continue
        if pending.strip():
            yield pending
        pending = ""
    assert not pending, pending


def _more_of(command: str) -> str:
    """Return the arguments that a command gets beside those on the page."""
    more = ""
    if "-m scene_graph_ros.node" in command:
        # On a busy machine a robot may not be heard of for seconds, and an end takes as long.
        more += " -p max_pose_age:=60.0 -p shutdown_timeout:=20.0"
    if "browser:=" in command:
        # The page is served at a port of its own: another test may have the usual one.
        more += " -p browser_port:=0"
    return more


class Reader:
    """Runs the blocks of one page."""

    def __init__(self, page: Path, folder: Path, variables: dict[str, str]) -> None:
        self._folder, self._page = folder, page
        self._follow = FOLLOW_EACH_OTHER in " ".join(page.read_text().split())
        self._session: Session | None = None
        self._lasting: list[Process] = []
        self._scene = ""
        self._make_folder()
        self._variables = {
            **variables,
            "PATH": f"{folder / '.venv' / 'bin'}{os.pathsep}{variables['PATH']}",
        }

    def _make_folder(self) -> None:
        """Make what a checkout has, the environment's Python, and a scene of the reader's."""
        for name in ("config", "docs", "examples", "package.xml"):
            (self._folder / name).symlink_to(ROOT / name)
        shutil.copytree(ROOT / "config" / "scenes" / "meshes", self._folder / "meshes")
        trimesh.creation.box([0.1, 0.06, 0.04]).export(self._folder / "meshes" / "sponge.obj")
        scene = ROOT / "config" / "scenes" / "panda_cell.yaml"
        (self._folder / "my_cell.yaml").write_text(scene.read_text())
        programs = self._folder / ".venv" / "bin"
        programs.mkdir(parents=True)
        ros2 = f"{sys.executable} {_SUPPORT / 'ros2_command.py'}"
        targets = {"python": sys.executable, "python3": sys.executable, "ros2": ros2}
        for name, target in targets.items():
            (programs / name).write_text(f'#!/bin/sh\nexec {target} "$@"\n')
            (programs / name).chmod(0o755)

    def run(self, blocks: list[Block]) -> None:
        """Run the page; fails at the first block that fails or prints something else."""
        with ExitStack() as stack:
            stack.callback(self._close)
            printed = ""
            for block in blocks:
                if block.mark == "output":
                    problem = difference(block.text, printed)
                    assert not problem, f"{block.place}: {problem}"
                elif not block.mark and block.language != DRAWN:
                    printed = self._run(block)

    def _run(self, block: Block) -> str:
        file = _FILE.match(block.text)
        if file and (block.language != "yaml" or "/" not in file[1]):
            (self._folder / file[1]).parent.mkdir(parents=True, exist_ok=True)
            (self._folder / file[1]).write_text(block.text)
            return ""
        run: Any = getattr(self, f"_run_{block.language}")
        return run(block)

    def _run_python(self, block: Block) -> str:
        if self._session is None or not self._follow:
            self._end_session()
            self._session = Session(self._folder, self._variables)
        return self._session.run(block)

    def _run_sh(self, block: Block) -> str:
        printed, here = "", []
        for command in commands(block.text):
            if "# in another terminal" not in command:
                self._interrupt(here)
            if _LASTING.search(command):
                words = shlex.join(shlex.split(command, comments=True)) + _more_of(command)
                here.append(Process(words, self._folder, self._variables))
                self._lasting.append(here[-1])
                here[-1].wait_until_it_runs()
            else:
                printed += self._shell(command, block)
        return printed

    def _interrupt(self, processes: list[Process]) -> None:
        """End what a block has started, as another command follows in the same terminal."""
        while processes:
            self._lasting.remove(processes[-1])
            processes.pop().interrupt()

    def _shell(self, command: str, block: Block) -> str:
        done = subprocess.run(
            ["bash", "-c", command],
            cwd=self._folder,
            env=self._variables,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=DEADLINE,
            check=False,
        )
        # A command that is to fail says so by the comment behind it.
        expected = int((re.search(r"# exit code (\d+)", command) or [0, 0])[1])
        problem = f"{block.place}: {command}\nended with {done.returncode}:\n{done.stdout}"
        assert done.returncode == expected, problem
        return done.stdout

    def _run_yaml(self, block: Block) -> str:
        """Check a scene; a part of one is added to the page's first scene, or to the reader's."""
        if "version:" in block.text:
            scene = block.text
            self._scene = self._scene or scene
        else:
            base = yaml.safe_load(self._scene or (self._folder / "my_cell.yaml").read_text())
            for key, value in yaml.safe_load(block.text).items():
                named = {item["name"] for item in value}
                others = [item for item in base.get(key, []) if item["name"] not in named]
                base[key] = [*others, *value]
            scene = yaml.safe_dump(base)
        file = self._folder / "block.yaml"
        file.write_text(scene)
        with _ONE_CHECKS:
            report = Checker(Packages.of(None, ())).check(str(file))
        assert not report.errors + report.warnings, f"{block.place}: {report}"
        return ""

    def _run_xml(self, block: Block) -> str:
        ET.fromstring(block.text)
        return ""

    def _end_session(self) -> None:
        if self._session is not None:
            self._session.close()
            self._session = None

    def _close(self) -> None:
        with ExitStack() as stack:
            for process in self._lasting:
                stack.callback(process.interrupt)
            stack.callback(self._end_session)
