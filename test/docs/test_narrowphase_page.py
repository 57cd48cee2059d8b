"""The page on the narrow phase says who decides: counted anew, and nothing else has taken over."""

from __future__ import annotations

import itertools
from pathlib import Path
import re

from deciding import count_apart, COUNTED, KINDS, PAGE, read, shares
import pytest

from scene_graph_ros.geometry.narrowphase.mechanism import Mechanism

ROOT = Path(__file__).parents[2]
TEXT = PAGE.read_text()

ROUNDED = {"benchmark scenes": 0.5, "hard corpus": 2.0}
"""Percent: much of the corpus touches to rounding, which machines may do differently."""

DIGITS = 0.05
"""Percent: shares are stated to three digits."""


@pytest.mark.parametrize("name", COUNTED)
def test_who_decides_is_what_the_page_says(name):
    """Both ways: a mechanism that decides more than it says is news, too."""
    found, stated = shares(count_apart(name)), read(name, TEXT)
    assert set(stated) == set(found)
    for pair, row in found.items():
        for mechanism in {*row, *stated[pair]}:
            share, is_stated = row.get(mechanism, 0.0), stated[pair].get(mechanism, 0.0)
            assert share == pytest.approx(is_stated, abs=ROUNDED[name] + DIGITS), (pair, mechanism)


def test_the_corpus_has_all_pairs():
    """Each two kinds that have an answer, in their order."""
    pairs = set(itertools.combinations_with_replacement(KINDS, 2)) - {("half space", "half space")}
    assert set(read("hard corpus", TEXT)) == pairs


def test_every_mechanism_is_explained():
    """In the table of mechanisms, each once."""
    names = re.findall(r"^\| `([A-Z_]+)` \|", TEXT, re.M)
    assert names == [mechanism.name for mechanism in Mechanism]


def test_every_file_of_the_narrow_phase_is_named():
    """And no file that is not there."""
    folder = ROOT / "scene_graph_ros" / "geometry" / "narrowphase"
    files = {path.name for path in folder.rglob("*.py")} - {"__init__.py"}
    named = set(re.findall(r"`(?:\w+/)*(\w+\.py)`", TEXT))
    assert files - named == set()
    others = {path.name for path in (ROOT / "scene_graph_ros").rglob("*.py")}
    assert named - others == {Path(__file__).name}
