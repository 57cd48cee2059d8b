"""The page on the inside of planning names every file of it."""

from __future__ import annotations

from pathlib import Path
import re

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "docs" / "planning_inside.md").read_text()
PLANNING = ROOT / "scene_graph_ros" / "planning"
COMMON = {"__init__.py", "arguments.py", "errors.py", "plan_failure.py"}
"""In many rooms alike: checks of arguments, errors, reasons of failures."""


def test_every_room_and_file_is_named():
    """And none that is not there."""
    rooms = {p.name for p in PLANNING.iterdir() if p.is_dir() and (p / "__init__.py").exists()}
    named = set(re.findall(r"^`(\w+)/`: ", TEXT, re.M))
    assert rooms - named <= {"trajectories"}  # the names of the package of trajectories
    files = {path.name for path in PLANNING.rglob("*.py")} - COMMON
    written = {Path(name).name for name in re.findall(r"`((?:\w+/)*\w+\.py)`", TEXT)}
    assert files - written == set()
    assert written - files == set()
