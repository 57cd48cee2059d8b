"""Runs the replay of recordings, for tests."""

from __future__ import annotations

import re
import subprocess
import sys

from forked import run_forked
from node_harness import environment, ROOT

DEADLINE = 120.0


REPLAY = """
import sys
from scene_graph_ros.replay.__main__ import main
sys.exit(main())
"""


def replay(domain, *arguments, fresh=False):
    """Run the command; return its exit code and all that it said.

    As a user does where it is ``fresh``, else in a process that has the imports behind it.
    """
    options = ["--quiet", *map(str, arguments)]
    if fresh:
        command = [sys.executable, "-m", "scene_graph_ros.replay", *options]
        done = subprocess.run(
            command,
            env=environment(domain),
            cwd=ROOT,
            capture_output=True,
            text=True,
            timeout=DEADLINE,
            check=False,
        )
        return done.returncode, done.stdout + done.stderr
    return run_forked(REPLAY, options, environment(domain), DEADLINE)


def counted(said):
    """Return inputs, edits, updates and contacts: equal, late, different."""
    line = next(line for line in said.splitlines() if line[:1].isdigit())
    return [int(number) for number in re.findall(r"\d+", line)]


def size_of(folder):
    """Return the bytes of a recording so far."""
    return sum(path.stat().st_size for path in folder.glob("*.mcap"))
