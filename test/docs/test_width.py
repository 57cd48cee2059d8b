"""Lines of pages are read in editors and in changes, so prose is no wider than code."""

from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
WIDTH = 100
LENGTH = 400
"""Lines of a page: tutorials, reference and measured rows have pages of their own."""
PAGES = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/*.md")])


def prose(page):
    """Return the numbered lines that can be broken: no code, tables, pictures or headings."""
    is_code = False
    for number, line in enumerate(page.read_text().splitlines(), 1):
        text = line.lstrip()
        if text.startswith("```"):
            is_code = not is_code
        elif not is_code and not text.startswith(("|", "![", "<", "#")):
            yield number, line


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_lines_of_prose_are_no_wider_than_those_of_code(page):
    """But for what has no space to break it at."""
    wide = [
        number for number, line in prose(page) if len(line) > WIDTH and " " in line.strip()[:WIDTH]
    ]
    assert not wide, f"{page.name}: lines {wide}"


@pytest.mark.parametrize("page", sorted(ROOT.glob("docs/*.md")), ids=lambda page: page.name)
def test_pages_are_read_at_a_sitting(page):
    """A page that grows beyond the limit is divided."""
    assert len(page.read_text().splitlines()) <= LENGTH
