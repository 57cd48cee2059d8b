"""Runs the replay of recordings, for tests."""

from __future__ import annotations

import re
import subprocess
import sys

from node_harness import environment, ROOT

DEADLINE = 120.0


def replay(domain, *arguments):
    """Run the command; return its exit code and all that it said."""
    done = subprocess.run(
        [sys.executable, "-m", "scene_graph_ros.replay", "--quiet", *map(str, arguments)],
        env=environment(domain),
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=DEADLINE,
        check=False,
    )
    return done.returncode, done.stdout + done.stderr


def counted(said):
    """Return inputs, edits, updates and contacts: equal, late, different."""
    return [int(number) for number in re.findall(r"\d+", said.splitlines()[0])]


def size_of(folder):
    """Return the bytes of a recording so far."""
    return sum(path.stat().st_size for path in folder.glob("*.mcap"))
