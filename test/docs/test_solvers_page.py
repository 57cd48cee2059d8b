"""The page on the solvers says who answers: counted anew, and every file of theirs is named."""

from __future__ import annotations

from pathlib import Path
import re

import pytest
from solver_counts import counted, PAGE, read

ROOT = Path(__file__).parents[2]
TEXT = PAGE.read_text()

ROUNDED = 3.0
"""Percent: one of forty questions may be nearer to rounding on another processor."""


def test_who_answers_is_what_the_page_says():
    """Both ways: a solver that answers more often than stated is news, too."""
    found, stated = counted(), read()
    assert set(found) == set(stated)
    for asked, counts in found.items():
        total = sum(counts.values())
        for solver in {*counts, *stated[asked]}:
            share = 100.0 * counts[solver] / total
            is_stated = stated[asked].get(solver, 0.0)
            assert share == pytest.approx(is_stated, abs=ROUNDED), (asked, solver)


def test_every_file_of_solvers_and_questions_is_named():
    """And each that is named is there."""
    convex = ROOT / "scene_graph_ros" / "convex"
    solvers = {str(p.relative_to(convex / "solve")) for p in (convex / "solve").rglob("*.py")}
    questions = {path.name for path in (convex / "questions").glob("*.py")}
    named = set(re.findall(r"`((?:\w+/)*\w+\.py)`", TEXT))
    there = {name for name in solvers | questions if not name.endswith("__init__.py")}
    assert there - named == set()
    tests = {path.name for path in (ROOT / "test").rglob("test_*.py")}
    others = {name for name in named - there if Path(name).name not in tests}
    assert others == set()
