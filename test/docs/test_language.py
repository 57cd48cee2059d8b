"""Docstrings name things: relative clauses with "what" and "who" stay below a ceiling."""

from __future__ import annotations

import ast
import functools
from pathlib import Path
import re

import pytest

ROOT = Path(__file__).parents[2]
CLAUSES = re.compile(r"\b(?:what|whatever|who|whom)\b", re.I)
OPENINGS = re.compile(r"\s*(?:Return|Say|Tell|Find)\s+(?:what|how|where|which|who)\b")

CEILINGS = {
    "msg_adapters": 1.0,
    "scene_graph_ros": 1.0,
    "scene_graph_ros/client": 1.0,
    "scene_graph_ros/convex": 2.0,
    "scene_graph_ros/geometry": 2.0,
    "scene_graph_ros/node": 1.0,
    "scene_graph_ros/planning": 2.0,
    "scene_graph_ros/replay": 1.0,
    "scene_graph_ros/robots": 2.0,
    "scene_graph_ros/scene_files": 1.0,
    "scene_graph_ros/sensing": 2.0,
    "scene_graph_ros/trajectories": 2.0,
    "scene_graph_ros/views": 1.0,
    "scene_graph_ros/warmup": 1.0,
}
"""Such words in 1000 of docstrings."""

MOST_OPENINGS = 30
"""Docstrings that open with a verb and such a clause, in all packages."""


@functools.cache
def _docstrings(package: str) -> list[str]:
    folder = ROOT / package
    files = folder.glob("*.py") if package == "scene_graph_ros" else folder.rglob("*.py")
    kinds = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    trees = (ast.parse(path.read_text()) for path in files)
    nodes = (node for tree in trees for node in ast.walk(tree) if isinstance(node, kinds))
    return [ast.get_docstring(node) or "" for node in nodes]


def test_each_package_has_a_ceiling():
    """Also a new one."""
    folders = {p.parent for p in (ROOT / "scene_graph_ros").glob("*/__init__.py")}
    named = {f"scene_graph_ros/{folder.name}" for folder in folders}
    assert named == {name for name in CEILINGS if "/" in name}


@pytest.mark.parametrize("package", CEILINGS)
def test_clauses_are_few(package):
    """Of all words in docstrings."""
    words, clauses = 0, 0
    for text in _docstrings(package):
        words += len(re.findall(r"[A-Za-z']+", text))
        clauses += len(CLAUSES.findall(text))
    assert 1000 * clauses <= CEILINGS[package] * words


def test_few_docstrings_open_with_a_clause():
    """A noun says what comes back."""
    texts = [text for package in CEILINGS for text in _docstrings(package)]
    assert sum(bool(OPENINGS.match(text)) for text in texts) <= MOST_OPENINGS
